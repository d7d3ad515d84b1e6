// The JSON head of an effect file: the one place that declares its parameters, passes, derived constants,
// tolerances and charts. ISF v2, plus brume's own keys (docs/DESIGN.md).
#pragma once

#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "effect/parameter.hpp"
#include "effect/size_expression.hpp"

namespace brume {

struct Pass {
    std::string target;            ///< empty: this pass writes the effect's output
    SizeExpression width, height;  ///< empty: the input's size
    bool isFloat = false;
    bool persistent = false;
    SizeExpression when;    ///< the pass runs if non-zero; empty: always
    SizeExpression repeat;  ///< runs that often, `passRepeat` counting from 0; empty: once
    struct Compute {
        int localSize[3] = {8, 8, 1};
        SizeExpression over[2];  ///< invocations in x and y; empty: the target's width and height
    };
    std::optional<Compute> compute;
};

/// A constant, table or volume that the C++ half computes once, in fp64, and both halves read in fp32.
struct Derived {
    enum class Type { Float, Int, Vec2, Vec3, Vec4, Mat4, Array, Vec4Array, Volume };
    std::string name;
    Type type = Type::Float;
    std::vector<SizeExpression> size;  ///< Array, Vec4Array: one; Volume: width, height, depth
    std::vector<std::string>
        from;  ///< parameters, and "camera", "size", "time", "frame", "sidecar": the cache key
};

struct Tolerance {
    double abs = 1e-6, rel = 2e-5;  ///< GLSL against CPU
    double reference = 2e-6;        ///< CPU against the reference, relative to its scale
    double measured = -1;           ///< the largest part of these bounds ever used, as a fraction
    std::string reason;
};

/// An image the file brings along or an image beside the frame's.
struct ImportedImage {
    std::string name, path;
};

struct Chart;

struct EffectHeader {
    std::string name;  ///< the file's stem: the effect's id
    std::string path;
    std::string description, credit;
    std::vector<std::string> categories;
    std::vector<std::string>
        breaks;  ///< BREAKS: where each method fails, one sentence each, for `brume info`
    std::vector<Parameter> parameters;
    std::vector<Pass> passes;  ///< at least one; the last writes the output
    std::vector<Derived> derived;
    std::vector<ImportedImage> imported;
    bool linear = false;     ///< SPACE: linear, GLSL 4.50, top-left addressing; false: a foreign ISF file
    bool pointwise = false;  ///< output pixel depends on the input's same pixel only
    bool writesTransmittance = false;
    Tolerance tolerance;
    std::shared_ptr<const Chart> chart;               ///< CHART, or null (effect/header_chart.hpp)
    std::shared_ptr<const nlohmann::json> stability;  ///< STABILITY as written, or null
    std::string body;                                 ///< the GLSL after the comment
    int bodyLine = 1;                                 ///< the line of `path` on which the body begins

    /// The image parameter that the chain's `input` is bound to: "inputImage", in a foreign file else
    /// "startImage" or its first; empty for a generator.
    std::string mainImage() const;
};

/// Parses an effect file. Throws Error (Usage) naming file, line where known, the key and what it should be;
/// unknown brume keys get their nearest match.
EffectHeader parseHeader(const std::string& path, const std::string& fileText);
EffectHeader readHeader(const std::string& path);

/// False where a parameter's WHEN says that beside these values its own cannot matter. True as long as WHEN
/// asks about a value that is still "auto".
bool isUsed(const EffectHeader& header, const Parameter& parameter, const ParameterValues& values);

/// WHEN in words, "model is power and density2 > 0": parameters called by `calledBy`, their name or label.
std::string conditionWords(const EffectHeader& header, const Parameter& parameter,
                           std::string Parameter::*calledBy);

/// What size expressions may mention for these values: numeric parameters, choice identifiers, int derived.
std::map<std::string, double> expressionVariables(const EffectHeader& header, const ParameterValues& values);

}  // namespace brume
