#include "effect/header_chart.hpp"

#include <algorithm>
#include <sstream>

#include "effect/header_parts.hpp"

namespace brume {

using json = nlohmann::json;

namespace {

ParameterValues readSet(const json& object, const char* key, const EffectHeader& header, const Where& where) {
    ParameterValues set;
    auto found = object.find(key);
    if (found == object.end()) return set;
    if (!found->is_object()) where.fail(key, " must be an object of parameters and values");
    std::vector<std::string> known;
    for (const Parameter& p : header.parameters) known.push_back(p.name);
    for (const auto& [name, value] : found->items()) {
        const Parameter* parameter = findParameter(header.parameters, name);
        if (!parameter) where.fail(key, ": no parameter '", name, "'", suggestion(name, known));
        set[name] = parseValue(*parameter, value, where.place + ": " + key);
    }
    return set;
}

std::string nameOf(const json& object, const Where& where) {
    if (!object.is_object()) where.fail("each must be an object");
    std::string name = textOf(object, "NAME", where);
    if (name.empty()) where.fail("NAME is missing");
    return name;
}

const json& arrayOf(const json& object, const char* key, const Where& where) {
    static const json none = json::array();
    auto found = object.find(key);
    if (found == object.end()) return none;
    if (!found->is_array()) where.fail(key, " must be an array");
    checkCount(*found, key, mostOfChart, where);
    return *found;
}

std::vector<std::string> casesOf(const json& object, const Chart& chart, const Where& where) {
    std::vector<std::string> names, known;
    for (const auto& c : chart.cases) known.push_back(c.name);
    for (const json& item : arrayOf(object, "CASES", where)) {
        names.push_back(item.get<std::string>());
        if (std::find(known.begin(), known.end(), names.back()) == known.end())
            where.fail("CASES: no case '", names.back(), "'", suggestion(names.back(), known));
    }
    return names;
}

Chart::Method readMethod(const json& object, const EffectHeader& header, const Chart& chart,
                         const Where& outer) {
    Chart::Method method;
    method.name = nameOf(object, outer);
    const Where where = outer.in("'" + method.name + "'");
    where.checkKeys(object, {"NAME", "SET", "KNOB", "VALUES", "CASES", "BACKENDS"});
    method.set = readSet(object, "SET", header, where);
    method.knob = textOf(object, "KNOB", where);
    method.cases = casesOf(object, chart, where);
    const json& values = arrayOf(object, "VALUES", where);
    if (method.knob.empty() != values.empty()) where.fail("KNOB and VALUES need each other");
    if (!method.knob.empty())
        for (const json& value : values)
            method.values.push_back(
                readSet(json{{"VALUES", {{method.knob, value}}}}, "VALUES", header, where).at(method.knob));
    if (object.contains("BACKENDS")) {
        method.onCpu = method.onGl = false;
        for (const json& backend : arrayOf(object, "BACKENDS", where)) {
            if (backend != "cpu" && backend != "gl") where.fail("BACKENDS may hold \"cpu\" and \"gl\"");
            (backend == "cpu" ? method.onCpu : method.onGl) = true;
        }
    }
    return method;
}

template <class Items>
void checkNamesDiffer(const Items& items, const Where& where) {
    for (size_t k = 0; k < items.size(); k++)
        for (size_t l = 0; l < k; l++)
            if (items[k].name == items[l].name) where.fail("'", items[k].name, "' is there twice");
}

std::vector<Chart::Method> choicesOfAuto(const EffectHeader& header) {
    for (const Parameter& p : header.parameters)
        if (p.allowsAuto && !p.values.empty()) {
            std::vector<Chart::Method> methods;
            for (size_t k = 0; k < p.values.size(); k++) {
                Chart::Method method;
                method.name = k < p.labels.size() ? p.labels[k] : std::to_string(p.values[k]);
                method.set[p.name] = ParameterValue{{double(p.values[k])}};
                methods.push_back(method);
            }
            return methods;
        }
    Chart::Method only;
    only.name = header.name;
    return {only};
}

void lay(ParameterValues& values, const ParameterValues& over) {
    for (const auto& [name, value] : over) values[name] = value;
}

}  // namespace

Chart readChart(const json& object, const EffectHeader& header, const Where& where) {
    if (!object.is_object()) where.fail("must be an object");
    where.checkKeys(object, {"SET", "REFERENCE", "BEFORE", "CASES", "METHODS", "PEERS"});
    Chart chart;
    chart.set = readSet(object, "SET", header, where);
    chart.reference = readSet(object, "REFERENCE", header, where);
    json steps = json::array();  // an effect's name stands for its defaults
    for (const json& step : arrayOf(object, "BEFORE", where))
        steps.push_back(step.is_string() ? json{{"effect", step}} : step);
    if (!steps.empty()) chart.before = json{{"effects", steps}}.dump();
    for (const json& item : arrayOf(object, "CASES", where)) {
        const Where here = where.in("CASES");
        here.checkKeys(item, {"NAME", "SET"});
        chart.cases.push_back({nameOf(item, here), readSet(item, "SET", header, here)});
    }
    for (const json& item : arrayOf(object, "METHODS", where))
        chart.methods.push_back(readMethod(item, header, chart, where.in("METHODS")));
    for (const json& item : arrayOf(object, "PEERS", where)) {
        const Where here = where.in("PEERS");
        here.checkKeys(item, {"NAME", "RUN", "CASES"});
        Chart::Peer peer{nameOf(item, here), textOf(item, "RUN", here), casesOf(item, chart, here)};
        if (peer.run.empty() || peer.run.find('/') != std::string::npos || peer.run[0] == '.')
            here.fail("'", peer.name, "': RUN must name a program in the effect's own folder");
        chart.peers.push_back(peer);
    }
    size_t variants = 0;
    for (const auto& method : chart.methods) variants += std::max<size_t>(1, method.values.size());
    variants *= std::max<size_t>(1, chart.cases.size());
    if (variants > mostVariants)
        where.fail("CASES and METHODS make ", variants, " variants; at most ", mostVariants);
    checkNamesDiffer(chart.cases, where.in("CASES"));
    checkNamesDiffer(chart.methods, where.in("METHODS"));
    checkNamesDiffer(chart.peers, where.in("PEERS"));
    return chart;
}

bool listed(const std::vector<std::string>& names, const std::string& name) {
    return names.empty() || std::find(names.begin(), names.end(), name) != names.end();
}

std::string ChartVariant::label(const EffectHeader& header) const {
    if (knob.empty()) return method;
    const json value = toJson(*findParameter(header.parameters, knob), knobValue);
    return method + ", " + knob + " " + (value.is_string() ? value.get<std::string>() : value.dump());
}

std::vector<ChartVariant> chartVariants(const EffectHeader& header) {
    Chart chart = header.chart ? *header.chart : Chart{};
    if (chart.cases.empty()) chart.cases.emplace_back();
    if (chart.methods.empty()) chart.methods = choicesOfAuto(header);
    std::vector<ChartVariant> variants;
    for (const auto& problem : chart.cases)
        for (const auto& method : chart.methods) {
            if (!listed(method.cases, problem.name)) continue;
            ChartVariant variant;
            variant.caseName = problem.name;
            variant.method = method.name;
            variant.onCpu = method.onCpu;
            variant.onGl = method.onGl;
            ParameterValues set = chart.set;
            lay(set, problem.set);
            lay(set, method.set);
            for (size_t k = 0; k < std::max<size_t>(1, method.values.size()); k++) {
                if (!method.knob.empty()) {
                    variant.knob = method.knob;
                    variant.knobValue = set[method.knob] = method.values[k];
                }
                variant.values = defaultValues(header.parameters);
                lay(variant.values, set);
                variant.truth = variant.values;
                lay(variant.truth, chart.reference);
                variant.given.clear();
                for (const auto& [name, value] : set) variant.given.push_back(name);
                variants.push_back(variant);
            }
        }
    return variants;
}

}  // namespace brume
