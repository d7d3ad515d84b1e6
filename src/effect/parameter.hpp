// Parameters: what an effect's header declares, and the values a preset gives them.
#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "effect/size_expression.hpp"

namespace brume {

enum class ParameterType { Event, Bool, Long, Float, Point2D, Point3D, Color, Image, Audio, AudioFft, List };

/// How many numbers a value of this type has: 1 to 4, 0 for images, audio and lists.
int componentCount(ParameterType type);

/// A value of any type. Numbers are kept as written (double) so that presets survive a round trip; effects
/// get them rounded to fp32.
struct ParameterValue {
    std::vector<double> numbers;  ///< componentCount of them; bool and event are 0 or 1
    std::string text;             ///< Image: the name of the image
    bool automatic = false;       ///< "auto": the plan (a method) or the picture (a colour) decides
    std::vector<std::map<std::string, ParameterValue>> rows;  ///< List

    bool operator==(const ParameterValue&) const = default;
};

struct Parameter {
    std::string name, label, unit, hint, group;
    ParameterType type = ParameterType::Float;
    ParameterValue defaultValue;
    std::vector<double> min, max;      ///< componentCount numbers each, or empty: unbounded
    std::vector<double> uiMin, uiMax;  ///< likewise; empty: min and max
    std::vector<long> values;          ///< Long with VALUES: the choices ...
    std::vector<std::string> labels;   ///< ... and their names, used in presets and on the command line
    bool allowsAuto = false;           ///< may be "auto"
    std::vector<Parameter> fields;     ///< List
    int maxRows = 0;                   ///< List
    bool resample = true;              ///< Image: brought to the output's size and four channels, or not
    SizeExpression when;               ///< it can matter where this is not 0; empty: always
    std::string sidecar;  ///< key of the frame's sidecar that supplies it where the preset does not

    /// True where the value is compiled into the shader instead of being a uniform: bool, and long with
    /// VALUES.
    bool isCompiledIn() const;
    /// The GLSL and size-expression identifier of a choice: "<name>_<label>", lower case, other characters as
    /// _.
    std::string choiceIdentifier(size_t choice) const;
};

using ParameterValues = std::map<std::string, ParameterValue>;

/// A value from JSON: numbers, arrays, booleans, a label of VALUES, "auto", "#rrggbb" for colours
/// (sRGB-encoded), an array of objects for lists. Throws Error (Usage) naming `where`, the parameter, the
/// offending value, and the range or nearest label.
ParameterValue parseValue(const Parameter& parameter, const nlohmann::json& json, const std::string& where);
/// The same from the command line's text: "3", "exponential", "(.6,.65,.7)", "#a0b0c0", "true".
ParameterValue parseArgument(const Parameter& parameter, const std::string& argument,
                             const std::string& where);
/// What parseValue reads back unchanged.
nlohmann::json toJson(const Parameter& parameter, const ParameterValue& value);

/// Every parameter's default, in the header's order.
ParameterValues defaultValues(const std::vector<Parameter>& parameters);

/// The parameter of that name, or null.
const Parameter* findParameter(const std::vector<Parameter>& parameters, const std::string& name);

}  // namespace brume
