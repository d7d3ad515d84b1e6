#include "effect/chain.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "error.hpp"
#include "frame/airlight.hpp"

namespace brume {

using json = nlohmann::json;

std::string Step::imageOf(const std::string& parameter) const {
    if (parameter == effect->header.mainImage()) return input;
    const std::string& named = values.at(parameter).text;
    return named.empty() ? "captured" : named;
}

bool Step::reads(const std::string& image) const {
    for (const auto& parameter : effect->header.parameters)
        if (parameter.type == ParameterType::Image && imageOf(parameter.name) == image) return true;
    return false;
}

bool Chain::readsTransmittance(const std::vector<std::string>& keep) const {
    if (std::find(keep.begin(), keep.end(), "transmittance") != keep.end()) return true;
    return std::any_of(steps.begin(), steps.end(),
                       [](const Step& step) { return step.enabled && step.reads("transmittance"); });
}

bool Chain::needsGl() const {
    return std::any_of(steps.begin(), steps.end(),
                       [](const Step& step) { return step.enabled && !step.effect->hasCpu(); });
}

// What a sidecar path ("lights/point", "lights/directional/direction") leads to; null if the sidecar lacks
// it.
static json sidecarItem(const json& sidecar, const std::string& path) {
    std::vector<std::string> parts;
    std::stringstream stream(path);
    for (std::string part; std::getline(stream, part, '/');) parts.push_back(part);
    auto found = sidecar.find(parts.at(0));
    if (found == sidecar.end()) return nullptr;
    if (parts.size() == 1) return *found;
    json rows = json::array();
    if (found->is_array())
        for (const auto& row : *found)
            if (row.is_object() && row.value("type", "") == parts[1]) rows.push_back(row);
    if (parts.size() == 2) return rows;
    return rows.empty() || !rows[0].contains(parts[2]) ? json(nullptr) : rows[0][parts[2]];
}

Chain withSidecar(const Chain& chain, const FramePair& frame) {
    if (!frame.extras || !frame.extras->is_object()) return chain;
    Chain result = chain;
    for (auto& step : result.steps) {
        for (const auto& parameter : step.effect->header.parameters) {
            if (parameter.sidecar.empty() || step.given.count(parameter.name)) continue;
            json item = sidecarItem(*frame.extras, parameter.sidecar);
            if (item.is_null()) continue;
            if (parameter.type == ParameterType::List && item.is_array()) {
                for (auto& row : item) {
                    json known = json::object();
                    for (const auto& field : parameter.fields)
                        if (row.contains(field.name)) known[field.name] = row[field.name];
                    row = known;
                }
            }
            step.values[parameter.name] = parseValue(parameter, item, frame.name + ": sidecar: " + step.id);
        }
    }
    return result;
}

Chain withAirlight(const Chain& chain, const FramePair& frame, std::map<std::string, std::string>* why) {
    Chain result = chain;
    std::optional<Airlight> airlight;
    for (auto& step : result.steps) {
        for (const auto& parameter : step.effect->header.parameters) {
            auto& value = step.values.at(parameter.name);
            if (parameter.type != ParameterType::Color || !value.automatic) continue;
            if (!airlight) airlight = pickAirlight(frame);
            const auto& c = airlight->color;
            value = ParameterValue{{c[0], c[1], c[2], 1}};
            if (!why) continue;
            std::string& sentence = (*why)[step.id];
            sentence += text(sentence.empty() ? "" : "; ", parameter.name, " is (", float(c[0]), ", ",
                             float(c[1]), ", ", float(c[2]), "), the ", airlight->how);
        }
    }
    return result;
}

}  // namespace brume
