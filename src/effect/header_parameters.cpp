// INPUTS of an effect file.
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <map>

#include "effect/header_parts.hpp"
#include "strict_json.hpp"

namespace brume {

using json = nlohmann::json;

namespace {

const std::vector<std::pair<std::string, ParameterType>> typeNames = {
    {"event", ParameterType::Event},     {"bool", ParameterType::Bool},
    {"long", ParameterType::Long},       {"float", ParameterType::Float},
    {"point2D", ParameterType::Point2D}, {"point3D", ParameterType::Point3D},
    {"color", ParameterType::Color},     {"image", ParameterType::Image},
    {"audio", ParameterType::Audio},     {"audioFFT", ParameterType::AudioFft},
    {"list", ParameterType::List}};

// The types that foreign files also write: any capitals, and names of other hosts and of GLSL.
std::string isfTypeName(const std::string& written) {
    static const std::map<std::string, std::string> meant = {
        {"point2d", "point2D"}, {"vec2", "point2D"},      {"point", "point2D"}, {"point3d", "point3D"},
        {"vec3", "point3D"},    {"audiofft", "audioFFT"}, {"int", "long"},      {"integer", "long"},
        {"number", "float"},    {"double", "float"},      {"boolean", "bool"},  {"colour", "color"},
        {"vec4", "color"},      {"sampler2d", "image"},   {"texture", "image"}};
    std::string lower = written;
    std::transform(lower.begin(), lower.end(), lower.begin(),
                   [](unsigned char c) { return std::tolower(c); });
    auto found = meant.find(lower);
    return found == meant.end() ? lower : found->second;
}

// A DEFAULT, MIN or MAX: numbers, a scalar standing for every component.
std::vector<double> numbersOf(const json& object, const char* key, const Parameter& parameter,
                              const Where& where) {
    auto found = object.find(key);
    size_t count = componentCount(parameter.type);
    if (found == object.end() || found->is_null()) return {};
    std::vector<double> numbers;
    auto add = [&](const json& item) {
        if (item.is_number())
            numbers.push_back(item.get<double>());
        else if (item.is_boolean())
            numbers.push_back(item.get<bool>());
        else if (item.is_string() && !where.strict)
            numbers.push_back(
                isTrueWord(item.get<std::string>()) ? 1 : std::atof(item.get<std::string>().c_str()));
        else if (where.strict)
            where.fail(key, " must be ", count == 1 ? "a number" : "an array of numbers");
    };
    if (found->is_array())
        for (const auto& item : *found) add(item);
    else
        add(*found);
    if (numbers.size() == 1) numbers.resize(count, numbers[0]);
    if (parameter.type == ParameterType::Color && numbers.size() == 3) numbers.push_back(1);
    if (numbers.size() != count) {
        if (where.strict) where.fail(key, " needs ", count, " numbers, not ", numbers.size());
        numbers.resize(count, 0);
    }
    return numbers;
}

void readChoices(const json& object, Parameter& parameter, const Where& where) {
    auto values = object.find("VALUES");
    if (values == object.end()) return;
    if (!values->is_array()) {
        if (where.strict) where.fail("VALUES must be an array");
        return;
    }
    checkCount(*values, "VALUES", mostValues, where);
    for (const auto& value : *values) {
        if (value.is_number() && std::abs(value.get<double>()) > 1e9)
            where.fail("VALUES must be no larger than 10^9, not ", shownJson(value));
        else if (value.is_number())
            parameter.values.push_back(value.get<long>());
        else if (where.strict)
            where.fail("VALUES must be whole numbers");
        else
            parameter.values.push_back(std::atol(value.is_string() ? value.get<std::string>().c_str() : "0"));
    }
    if (auto labels = object.find("LABELS"); labels != object.end() && labels->is_array())
        for (const auto& label : *labels)
            parameter.labels.push_back(label.is_string() ? label.get<std::string>() : label.dump());
    if (where.strict && !parameter.labels.empty() && parameter.labels.size() != parameter.values.size())
        where.fail(parameter.values.size(), " VALUES but ", parameter.labels.size(), " LABELS");
}

}  // namespace

Parameter readParameter(const json& object, const Where& outer, bool isField) {
    if (!object.is_object()) outer.fail("each must be an object");
    Parameter parameter;
    parameter.name = nameOf(object, "NAME", outer);
    if (parameter.name.empty()) outer.fail("NAME is missing");
    Where where = outer.in("'" + parameter.name + "'");
    where.checkKeys(object, {"NAME",   "TYPE",     "LABEL",   "UNIT",     "HINT",     "GROUP",  "DEFAULT",
                             "MIN",    "MAX",      "UI_MIN",  "UI_MAX",   "VALUES",   "LABELS", "AUTO",
                             "FIELDS", "MAX_ROWS", "SIDECAR", "IDENTITY", "RESAMPLE", "WHEN"});
    std::string typeName = textOf(object, "TYPE", where);
    if (!where.strict) typeName = isfTypeName(typeName);
    std::vector<std::string> known;
    for (const auto& [name, type] : typeNames) known.push_back(name);
    auto type =
        std::find_if(typeNames.begin(), typeNames.end(), [&](auto& t) { return t.first == typeName; });
    if (type == typeNames.end()) where.fail("unknown TYPE '", typeName, "'", suggestion(typeName, known));
    parameter.type = type->second;
    if (isField && (componentCount(parameter.type) == 0 || parameter.type == ParameterType::Event))
        where.fail("a list's field cannot be of type ", typeName);

    parameter.label = textOf(object, "LABEL", where);
    if (parameter.label.empty()) parameter.label = parameter.name;
    parameter.unit = textOf(object, "UNIT", where);
    parameter.hint = textOf(object, "HINT", where);
    parameter.group = textOf(object, "GROUP", where);
    parameter.sidecar = textOf(object, "SIDECAR", where);
    if (isField && object.contains("WHEN")) where.fail("a list's field has no WHEN");
    if (where.strict) parameter.when = expressionOf(object, "WHEN", where);

    if (parameter.type == ParameterType::List) {
        auto fields = object.find("FIELDS");
        if (fields == object.end() || !fields->is_array() || fields->empty())
            where.fail("a list needs FIELDS, an array of parameters");
        checkCount(*fields, "FIELDS", mostFields, where);
        for (const auto& field : *fields)
            parameter.fields.push_back(readParameter(field, where.in("FIELDS"), true));
        auto rows = object.find("MAX");
        if (rows == object.end() || !rows->is_number_integer() || *rows < 1 || *rows > 65536)
            where.fail("a list needs MAX, the largest number of rows (1 to 65536)");
        parameter.maxRows = rows->get<int>();
        auto array = object.value("DEFAULT", json::array());
        parameter.defaultValue = parseValue(parameter, array, outer.place);
        return parameter;
    }
    if (parameter.type == ParameterType::Image) {
        if (where.strict) parameter.defaultValue.text = textOf(object, "DEFAULT", where);
        parameter.resample = !object.contains("RESAMPLE") || flagOf(object, "RESAMPLE");
        return parameter;
    }
    if (componentCount(parameter.type) == 0) return parameter;

    readChoices(object, parameter, where);
    parameter.allowsAuto = flagOf(object, "AUTO");
    parameter.min = numbersOf(object, "MIN", parameter, where);
    parameter.max = numbersOf(object, "MAX", parameter, where);
    parameter.uiMin = numbersOf(object, "UI_MIN", parameter, where);
    parameter.uiMax = numbersOf(object, "UI_MAX", parameter, where);
    if (parameter.type == ParameterType::Color && !where.strict) parameter.min.clear(), parameter.max.clear();

    auto given = object.find("DEFAULT");
    bool isWord = given != object.end() && given->is_string();
    if (where.strict && isWord) {
        parameter.defaultValue.numbers.assign(componentCount(parameter.type), 0);
        if (!parameter.values.empty()) parameter.defaultValue.numbers[0] = double(parameter.values[0]);
        parameter.defaultValue = parseValue(parameter, *given, outer.place);
        return parameter;
    }
    auto& numbers = parameter.defaultValue.numbers;
    numbers = numbersOf(object, "DEFAULT", parameter, where);
    if (numbers.empty()) {
        if (where.strict && parameter.type != ParameterType::Event) where.fail("DEFAULT is missing");
        if (!parameter.values.empty())
            numbers = {double(parameter.values[0])};
        else if (parameter.type == ParameterType::Float && parameter.min.size() && parameter.max.size())
            numbers = {std::clamp(0., parameter.min[0], std::max(parameter.min[0], parameter.max[0]))};
        else
            numbers.assign(componentCount(parameter.type), parameter.type == ParameterType::Color ? 1 : 0);
    }
    if (where.strict) {
        for (size_t k = 0; k < parameter.min.size() && k < parameter.max.size(); k++)
            if (parameter.min[k] > parameter.max[k]) where.fail("MIN is larger than MAX");
        json again = numbers.size() == 1 ? json(numbers[0]) : json(numbers);
        parseValue(parameter, again, outer.place);
    }
    return parameter;
}

// Inputs of foreign files: one without a name or of a kind of its own is the file's business, not a mistake;
// of two of one name the first counts.
std::vector<Parameter> readForeignInputs(const json& inputs, const Where& where) {
    std::vector<Parameter> parameters;
    for (const auto& input : inputs) {
        if (!input.is_object() || textOf(input, "NAME", where).empty()) continue;
        const std::string type = isfTypeName(textOf(input, "TYPE", where));
        const bool isKnown = type != "list" && std::any_of(typeNames.begin(), typeNames.end(),
                                                           [&](auto& known) { return known.first == type; });
        if (isKnown && !findParameter(parameters, textOf(input, "NAME", where)))
            parameters.push_back(readParameter(input, where, false));
    }
    return parameters;
}

}  // namespace brume
