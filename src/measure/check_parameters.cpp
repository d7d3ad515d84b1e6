// The parameter values every effect is checked at.
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "measure/check.hpp"

namespace brume {
namespace {

enum class Extreme { Min, Max };

bool isContinuous(const Parameter& p) {
    return componentCount(p.type) > 0 && !p.isCompiledIn() && p.type != ParameterType::Event;
}

// A range to draw from where the header gives none: round the default.
std::pair<double, double> rangeOf(const Parameter& p, int component, bool ui) {
    const auto& low = ui && !p.uiMin.empty() ? p.uiMin : p.min;
    const auto& high = ui && !p.uiMax.empty() ? p.uiMax : p.max;
    double middle = p.defaultValue.automatic ? .5 : p.defaultValue.numbers.at(component);
    double reach = middle != 0 ? std::abs(middle) : 1;
    return {low.empty() ? middle - reach : low[component], high.empty() ? middle + reach : high[component]};
}

double drawNumber(const Parameter& p, int component, bool ui, cv::RNG& random) {
    auto [low, high] = rangeOf(p, component, ui);
    double u = random.uniform(0., 1.);
    if (p.type == ParameterType::Long) return std::floor(low + u * (high - low + 1 - 1e-9));
    if (low > 0 && high / low > 100) return low * std::pow(high / low, u);
    return low + u * (high - low);
}

ParameterValue drawValue(const Parameter& p, cv::RNG& random, int rows = -1);

ParameterValues drawRow(const std::vector<Parameter>& fields, cv::RNG& random) {
    ParameterValues row;
    for (const Parameter& field : fields) row[field.name] = drawValue(field, random);
    return row;
}

ParameterValue drawValue(const Parameter& p, cv::RNG& random, int rows) {
    ParameterValue value = p.defaultValue;
    value.automatic = false;
    if (p.type == ParameterType::List) {
        value.rows.clear();
        int count = rows >= 0 ? rows : random.uniform(0, std::min(p.maxRows, 4) + 1);
        for (int k = 0; k < count; k++) value.rows.push_back(drawRow(p.fields, random));
    } else if (!p.values.empty()) {
        value.numbers = {double(p.values[random.uniform(0, int(p.values.size()))])};
    } else if (p.type == ParameterType::Bool || p.type == ParameterType::Event) {
        value.numbers = {double(random.uniform(0, 2))};
    } else if (componentCount(p.type) > 0) {
        bool ui = random.uniform(0, 2) && (!p.uiMin.empty() || !p.uiMax.empty());
        value.numbers.resize(componentCount(p.type));
        for (int c = 0; c < componentCount(p.type); c++) value.numbers[c] = drawNumber(p, c, ui, random);
    }
    return value;
}

// The default, with something concrete where it is "auto".
ParameterValue concreteDefault(const Parameter& p) {
    ParameterValue value = p.defaultValue;
    if (!value.automatic) return value;
    value.automatic = false;
    if (!p.values.empty())
        value.numbers = {double(p.values.front())};
    else
        for (int c = 0; c < componentCount(p.type); c++) {
            auto [low, high] = rangeOf(p, c, true);
            value.numbers.resize(componentCount(p.type));
            value.numbers[c] = low > 0 && high / low > 100 ? std::sqrt(low * high) : (low + high) / 2;
        }
    return value;
}

ParameterValue extremeValue(const Parameter& p, Extreme extreme) {
    ParameterValue value = concreteDefault(p);
    if (p.type == ParameterType::List) {
        value.rows.clear();
        for (int k = 0; extreme == Extreme::Max && k < std::min(p.maxRows, 2); k++) {
            ParameterValues row;
            for (const Parameter& field : p.fields) row[field.name] = extremeValue(field, extreme);
            value.rows.push_back(row);
        }
    } else if (isContinuous(p)) {
        const auto& bound = extreme == Extreme::Min ? p.min : p.max;
        if (!bound.empty()) value.numbers = bound;
    }
    return value;
}

template <class F>
ParameterValues forEachParameter(const EffectHeader& header, F valueOf) {
    ParameterValues values;
    for (const Parameter& p : header.parameters) values[p.name] = valueOf(p);
    return values;
}

// Everything random but what is compiled into the shader.
ParameterValues randomUniforms(const EffectHeader& header, const ParameterValues& compiledIn,
                               cv::RNG& random) {
    return forEachParameter(header, [&](const Parameter& p) {
        return p.isCompiledIn() ? compiledIn.at(p.name) : drawValue(p, random);
    });
}

}  // namespace

std::vector<std::pair<std::string, ParameterValues>> checkParameters(const EffectHeader& header,
                                                                     const CheckOptions& options) {
    std::vector<std::pair<std::string, ParameterValues>> sets;
    cv::RNG random(options.seed * 0x9e3779b97f4a7c15u + 1);
    ParameterValues base = forEachParameter(header, concreteDefault);
    sets.emplace_back("default", base);
    for (auto [name, extreme] : {std::pair("min", Extreme::Min), std::pair("max", Extreme::Max)})
        sets.emplace_back(name, forEachParameter(header, [extreme](const Parameter& p) {
                              return p.isCompiledIn() ? concreteDefault(p) : extremeValue(p, extreme);
                          }));
    for (const Parameter& p : header.parameters) {
        auto add = [&](const std::string& choice, double number) {
            ParameterValues values = base;
            values[p.name].numbers = {number};
            std::string name = p.name + "=" + choice;
            if (values != base) sets.emplace_back(name, values);
            sets.emplace_back(name + ", others random", randomUniforms(header, values, random));
        };
        for (size_t k = 0; k < p.values.size(); k++)
            add(k < p.labels.size() ? p.labels[k] : std::to_string(p.values[k]), double(p.values[k]));
        if (p.type == ParameterType::Bool)
            add(base[p.name].numbers[0] ? "false" : "true", !base[p.name].numbers[0]);
        if (p.type == ParameterType::List && p.maxRows > 0) {
            ParameterValues values = base;
            values[p.name] = drawValue(p, random, p.maxRows);
            sets.emplace_back(p.name + " full", values);
        }
    }
    for (int k = 1; k <= options.randomSets; k++)
        sets.emplace_back("random " + std::to_string(k),
                          forEachParameter(header, [&](const Parameter& p) { return drawValue(p, random); }));
    return sets;
}

}  // namespace brume
