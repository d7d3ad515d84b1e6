#include "effect/parameter.hpp"

#include <cctype>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "error.hpp"
#include "nearest_name.hpp"

namespace brume {

using json = nlohmann::json;

int componentCount(ParameterType type) {
    switch (type) {
        case ParameterType::Event:
        case ParameterType::Bool:
        case ParameterType::Long:
        case ParameterType::Float:
            return 1;
        case ParameterType::Point2D:
            return 2;
        case ParameterType::Point3D:
            return 3;
        case ParameterType::Color:
            return 4;
        default:
            return 0;
    }
}

bool Parameter::isCompiledIn() const {
    return type == ParameterType::Bool || (type == ParameterType::Long && !values.empty());
}

static std::string identifier(const std::string& text) {
    std::string id;
    for (unsigned char c : text) id += std::isalnum(c) ? char(std::tolower(c)) : '_';
    return id;
}

std::string Parameter::choiceIdentifier(size_t choice) const {
    return name + "_" +
           (choice < labels.size() ? identifier(labels[choice]) : std::to_string(values[choice]));
}

const Parameter* findParameter(const std::vector<Parameter>& parameters, const std::string& name) {
    for (const auto& parameter : parameters)
        if (parameter.name == name) return &parameter;
    return nullptr;
}

ParameterValues defaultValues(const std::vector<Parameter>& parameters) {
    ParameterValues values;
    for (const auto& parameter : parameters) values[parameter.name] = parameter.defaultValue;
    return values;
}

// An error's beginning: "preset.json: depth_fog.density: ".
static std::string at(const Parameter& parameter, const std::string& where) {
    return where.empty() ? parameter.name + ": " : where + "." + parameter.name + ": ";
}

static std::vector<std::string> choiceNames(const Parameter& parameter) {
    std::vector<std::string> names;
    for (size_t k = 0; k < parameter.values.size(); k++)
        names.push_back(k < parameter.labels.size() ? parameter.labels[k]
                                                    : std::to_string(parameter.values[k]));
    if (parameter.allowsAuto) names.push_back("auto");
    return names;
}

static ParameterValue choiceNamed(const Parameter& parameter, const std::string& label,
                                  const std::string& where) {
    for (size_t k = 0; k < parameter.labels.size() && k < parameter.values.size(); k++)
        if (identifier(parameter.labels[k]) == identifier(label)) return {{double(parameter.values[k])}};
    failUsage(at(parameter, where), "no choice '", label, "'", suggestion(label, choiceNames(parameter)));
}

static double srgbToLinear(double s) { return s <= .04045 ? s / 12.92 : std::pow((s + .055) / 1.055, 2.4); }

static ParameterValue hexColor(const Parameter& parameter, const std::string& hex, const std::string& where) {
    bool good = hex.size() == 7 || hex.size() == 9;
    for (size_t k = 1; k < hex.size(); k++) good = good && std::isxdigit((unsigned char)hex[k]);
    if (!good)
        failUsage(at(parameter, where), "'", hex, "' is no colour; write #rrggbb, or three linear numbers");
    ParameterValue value{{0, 0, 0, 1}};
    for (size_t k = 0; k * 2 + 1 < hex.size(); k++) {
        double byte = std::stoi(hex.substr(k * 2 + 1, 2), nullptr, 16) / 255.;
        value.numbers[k] = k < 3 ? srgbToLinear(byte) : byte;
    }
    return value;
}

static void checkRange(const Parameter& parameter, const ParameterValue& value, const std::string& where) {
    for (size_t k = 0; k < value.numbers.size(); k++) {
        double v = value.numbers[k];
        if (std::isnan(v) || std::abs(v) > std::numeric_limits<float>::max())
            failUsage(at(parameter, where), "the value must be a finite number");
        double low = k < parameter.min.size() ? parameter.min[k] : -HUGE_VAL;
        double high = k < parameter.max.size() ? parameter.max[k] : HUGE_VAL;
        if (v < low || v > high)
            failUsage(at(parameter, where), v, " is out of range; it must lie from ", low, " to ", high,
                      parameter.unit.empty() ? "" : " " + parameter.unit);
    }
    if (parameter.type == ParameterType::Long) {
        double v = value.numbers[0];
        if (v != std::floor(v)) failUsage(at(parameter, where), v, " must be a whole number");
        if (std::abs(v) > std::numeric_limits<int>::max())
            failUsage(at(parameter, where), v, " is out of range; whole numbers reach 2147483647");
        if (parameter.values.empty()) return;
        for (long choice : parameter.values)
            if (double(choice) == v) return;
        failUsage(at(parameter, where), "no choice ", v, suggestion(text(v), choiceNames(parameter)));
    }
}

static ParameterValue listValue(const Parameter& parameter, const json& array, const std::string& where) {
    if (!array.is_array()) failUsage(at(parameter, where), "must be an array of objects");
    if (array.size() > size_t(parameter.maxRows))
        failUsage(at(parameter, where), array.size(), " rows, at most ", parameter.maxRows, " are allowed");
    std::vector<std::string> names;
    for (const auto& field : parameter.fields) names.push_back(field.name);
    ParameterValue value;
    for (size_t r = 0; r < array.size(); r++) {
        std::string rowWhere = at(parameter, where);
        rowWhere = rowWhere.substr(0, rowWhere.size() - 2) + "[" + std::to_string(r) + "]";
        if (!array[r].is_object()) failUsage(rowWhere, ": must be an object with ", names.size(), " fields");
        auto row = defaultValues(parameter.fields);
        for (const auto& [key, item] : array[r].items()) {
            const Parameter* field = findParameter(parameter.fields, key);
            if (!field) failUsage(rowWhere, ": no field '", key, "'", suggestion(key, names));
            row[key] = parseValue(*field, item, rowWhere);
        }
        value.rows.push_back(std::move(row));
    }
    return value;
}

ParameterValue parseValue(const Parameter& parameter, const json& item, const std::string& where) {
    ParameterValue value;
    switch (parameter.type) {
        case ParameterType::List:
            return listValue(parameter, item, where);
        case ParameterType::Image:
        case ParameterType::Audio:
        case ParameterType::AudioFft:
            if (!item.is_string()) failUsage(at(parameter, where), "must be the name of an image");
            value.text = item.get<std::string>();
            return value;
        default:
            break;
    }
    if (item.is_string()) {
        auto word = item.get<std::string>();
        if (word == "auto") {
            if (!parameter.allowsAuto) failUsage(at(parameter, where), "cannot be \"auto\"");
            value = parameter.defaultValue;
            if (value.numbers.empty()) value.numbers.assign(componentCount(parameter.type), 0);
            value.automatic = true;
            return value;
        }
        if (parameter.type == ParameterType::Color) return hexColor(parameter, word, where);
        if (parameter.type == ParameterType::Long && !parameter.labels.empty())
            return choiceNamed(parameter, word, where);
        failUsage(at(parameter, where), "'", word, "' is not a number (units are left out)");
    }
    if (item.is_boolean() && parameter.type == ParameterType::Bool)
        value.numbers = {item.get<bool>() ? 1. : 0.};
    else if (item.is_number())
        value.numbers = {item.get<double>()};
    else if (item.is_array()) {
        for (const auto& number : item) {
            if (!number.is_number()) failUsage(at(parameter, where), "every element must be a number");
            value.numbers.push_back(number.get<double>());
        }
    } else {
        failUsage(at(parameter, where), "must be a number",
                  componentCount(parameter.type) > 1 ? " array" : "");
    }
    size_t wanted = componentCount(parameter.type);
    if (parameter.type == ParameterType::Color && value.numbers.size() == 3) value.numbers.push_back(1);
    if (value.numbers.size() != wanted)
        failUsage(at(parameter, where), "needs ", parameter.type == ParameterType::Color ? 3 : wanted,
                  wanted == 1 ? " number, not " : " numbers, not ", value.numbers.size(),
                  wanted > 1 ? "; on the command line write '(a,b,c)', in quotes" : "");
    if (parameter.type == ParameterType::Bool && value.numbers[0] != 0 && value.numbers[0] != 1)
        failUsage(at(parameter, where), "must be true or false");
    checkRange(parameter, value, where);
    return value;
}

ParameterValue parseArgument(const Parameter& parameter, const std::string& argument,
                             const std::string& where) {
    std::string word = argument;
    bool bracketed = word.size() >= 2 && word.front() == '(' && word.back() == ')';
    if (bracketed) word = "[" + word.substr(1, word.size() - 2) + "]";
    bool isName = parameter.type == ParameterType::Image;
    json item = isName ? json(word) : json::parse(word, nullptr, false);
    if (item.is_discarded()) {
        // JSON wants a digit before the point; people do not.
        std::string padded;
        for (size_t k = 0; k < word.size(); k++) {
            bool bare = word[k] == '.' && (k == 0 || !std::isdigit((unsigned char)word[k - 1]));
            padded += bare ? "0." : std::string(1, word[k]);
        }
        if (!padded.empty() && padded[0] == '+') padded.erase(0, 1);
        item = json::parse(padded, nullptr, false);
    }
    if (item.is_discarded()) item = word;
    return parseValue(parameter, item, where);
}

json toJson(const Parameter& parameter, const ParameterValue& value) {
    if (value.automatic) return "auto";
    if (parameter.type == ParameterType::List) {
        json array = json::array();
        for (const auto& row : value.rows) {
            json object = json::object();
            for (const auto& field : parameter.fields) object[field.name] = toJson(field, row.at(field.name));
            array.push_back(object);
        }
        return array;
    }
    if (componentCount(parameter.type) == 0) return value.text;
    if (parameter.type == ParameterType::Bool || parameter.type == ParameterType::Event)
        return value.numbers[0] != 0;
    if (parameter.type == ParameterType::Long) {
        for (size_t k = 0; k < parameter.values.size() && k < parameter.labels.size(); k++)
            if (double(parameter.values[k]) == value.numbers[0]) return parameter.labels[k];
        return long(value.numbers[0]);
    }
    if (componentCount(parameter.type) == 1) return value.numbers[0];
    auto numbers = value.numbers;
    if (parameter.type == ParameterType::Color && numbers[3] == 1) numbers.pop_back();
    return numbers;
}

}  // namespace brume
