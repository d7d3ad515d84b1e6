#include "effect/preset.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "effect/effect_path.hpp"
#include "error.hpp"
#include "file_status.hpp"
#include "install_root.hpp"
#include "nearest_name.hpp"
#include "strict_json.hpp"

namespace brume {

namespace fs = std::filesystem;
using json = nlohmann::json;
using ordered = nlohmann::ordered_json;

constexpr size_t mostSteps = 256;
static const std::vector<std::string> stepKeys = {"effect", "id", "input", "output", "enabled"};

static Step makeStep(const std::shared_ptr<const Effect>& effect) {
    Step step;
    step.effect = effect;
    step.id = effect->name();
    step.values = defaultValues(effect->header.parameters);
    return step;
}

static std::string textOf(const json& object, const char* key, const std::string& where) {
    if (!object.at(key).is_string()) failUsage(where, ": '", key, "' must be text");
    return object.at(key).get<std::string>();
}

static Step parseStep(const json& object, const std::string& where, const EffectRegistry& registry) {
    if (!object.is_object() || !object.contains("effect"))
        failUsage(where, ": each must be an object with an \"effect\"");
    std::string name = textOf(object, "effect", where);
    if (std::any_of(name.begin(), name.end(), [](unsigned char c) { return c < ' '; }))
        failUsage(where, ": an effect's name holds no control characters");
    const auto listed = registry.names();
    const bool isListed = std::find(listed.begin(), listed.end(), name) != listed.end();
    const bool isPath = name.find('/') != std::string::npos || name.ends_with(".fs");
    if (!isListed && !isPath && isFolder(name))
        failUsage(where, ": no effect '", name, "' is known, and a preset may not run the folder '", name,
                  "' here, as a plugin in it is native code: say where effects lie, with BRUME_EFFECT_PATH (",
                  name, "/build/effects, where brume new made it)");
    if (!isListed && isPath)
        failUsage(where, ": '", name,
                  "' is a path; a preset may only name effects that 'brume list' shows "
                  "(add their folder to BRUME_EFFECT_PATH), as a plugin beside a file is native code");
    std::shared_ptr<const Effect> effect;
    try {
        effect = registry.find(name);
    } catch (const Error& error) {
        failUsage(where, ": ", error.what());
    }
    Step step = makeStep(effect);
    auto known = stepKeys;
    for (const auto& parameter : effect->header.parameters) known.push_back(parameter.name);
    for (const auto& [key, item] : object.items()) {
        if (key == "effect") continue;
        if (key == "enabled") {
            if (!item.is_boolean()) failUsage(where, ": 'enabled' must be true or false");
            step.enabled = item.get<bool>();
        } else if (key == "id") {
            step.id = textOf(object, "id", where);
        } else if (key == "input") {
            step.input = textOf(object, "input", where);
        } else if (key == "output") {
            step.output = textOf(object, "output", where);
            if (step.output.find('/') != std::string::npos)
                failUsage(where, ": output: '", step.output, "' is a path; an image has a plain name");
        } else {
            const Parameter* parameter = findParameter(effect->header.parameters, key);
            if (!parameter)
                failUsage(where, ": ", name, " has no parameter '", key, "'", suggestion(key, known));
            step.values[key] = parseValue(*parameter, item, where + ": " + name);
            step.given.insert(key);
        }
    }
    return step;
}

// Ids must differ, or --set could not tell steps apart: the second depth_fog becomes depth_fog2.
static void makeIdsDiffer(Chain& chain, const std::string& where) {
    std::set<std::string> taken;
    for (auto& step : chain.steps)
        if (step.id != step.effect->name() && !taken.insert(step.id).second)
            failUsage(where, ": two effects have the id '", step.id, "'");
    for (auto& step : chain.steps) {
        if (step.id != step.effect->name()) continue;
        for (int k = 2; !taken.insert(step.id).second; k++) step.id = step.effect->name() + std::to_string(k);
    }
}

// Every image that is read must have been written before, or come with every frame (or with this one's
// capture).
static void checkImages(const Chain& chain, const std::string& where) {
    std::vector<std::string> known = {"color", "captured", "transmittance"};
    for (const auto& step : chain.steps) {
        for (const auto& parameter : step.effect->header.parameters) {
            if (parameter.type != ParameterType::Image) continue;
            std::string image = step.imageOf(parameter.name);
            bool fromSidecar = !parameter.sidecar.empty() && !step.given.count(parameter.name);
            if (!fromSidecar && std::find(known.begin(), known.end(), image) == known.end())
                failUsage(where, ": ", step.id, " reads the image '", image,
                          "', which no step before it writes", suggestion(image, known));
        }
        if (step.output == "captured" || step.output == "transmittance")
            failUsage(where, ": ", step.id, " cannot write '", step.output, "'; name another output");
        known.push_back(step.output);
    }
}

static void parsePolicy(const json& preset, Chain& chain, const std::string& where) {
    auto choose = [&](const char* key, const std::vector<std::string>& names) {
        std::string word = textOf(preset, key, where);
        auto found = std::find(names.begin(), names.end(), word);
        if (found == names.end())
            failUsage(where, ": ", key, ": no choice '", word, "'", suggestion(word, names));
        return int(found - names.begin());
    };
    if (preset.contains("unknown"))
        chain.policy.unknown = UnknownDepth(choose("unknown", {"fill", "far", "keep"}));
    if (preset.contains("smooth_depth")) {
        if (!preset["smooth_depth"].is_number() || !(preset["smooth_depth"] >= 0))
            failUsage(where, ": smooth_depth: ", shownJson(preset["smooth_depth"]), " is not a radius in px");
        chain.policy.smooth = preset["smooth_depth"].get<double>();
    }
    if (!preset.contains("sky")) return;
    if (preset["sky"].is_number()) {
        chain.policy.sky = SkyPolicy::AtDistance;
        chain.policy.skyDistance = preset["sky"].get<double>();
        if (!(chain.policy.skyDistance > 0) || !std::isfinite(chain.policy.skyDistance))
            failUsage(where, ": sky: a distance must be a positive number of metres");
    } else {
        chain.policy.sky =
            choose("sky", {"infinite", "untouched"}) ? SkyPolicy::Untouched : SkyPolicy::Infinite;
    }
}

Chain parsePreset(const std::string& jsonText, const std::string& where, const EffectRegistry& registry) {
    json preset;
    try {
        preset = parseJson(jsonText);
    } catch (const Error& error) {
        failUsage(where, ": ", error.what());
    } catch (const json::parse_error& error) {
        int line = 1 + int(std::count(jsonText.begin(),
                                      jsonText.begin() + std::min(error.byte, jsonText.size()), '\n'));
        failUsage(where, ":", line, ": not JSON: ", reasonOf(error));
    }
    const std::vector<std::string> known = {"name",    "description",  "sky",
                                            "unknown", "smooth_depth", "effects"};
    if (!preset.is_object()) failUsage(where, ": a preset is an object with \"effects\"");
    for (const auto& [key, item] : preset.items())
        if (std::find(known.begin(), known.end(), key) == known.end())
            failUsage(where, ": unknown key '", key, "'", suggestion(key, known));
    Chain chain;
    chain.name = preset.contains("name") ? textOf(preset, "name", where) : fs::path(where).stem().string();
    if (preset.contains("description")) chain.description = textOf(preset, "description", where);
    parsePolicy(preset, chain, where);
    if (!preset.contains("effects") || !preset["effects"].is_array())
        failUsage(where, ": \"effects\" must be an array");
    if (preset["effects"].size() > mostSteps)
        failUsage(where, ": ", preset["effects"].size(), " effects; at most ", mostSteps);
    for (size_t k = 0; k < preset["effects"].size(); k++)
        chain.steps.push_back(parseStep(preset["effects"][k], text(where, ": effects[", k, "]"), registry));
    makeIdsDiffer(chain, where);
    checkImages(chain, where);
    return chain;
}

Chain readPreset(const std::string& pathOrName, const EffectRegistry& registry) {
    std::string path = pathOrName;
    const bool isFile = !fs::path(path).extension().empty() && !isFolder(path);
    const bool isEffect = isEffectPath(path) && (isFolder(path) || fs::path(path).extension() == ".fs");
    const bool isName = !isEffectPath(path) && !isFile;
    if (isName || isEffect) {
        auto shipped = shippedPresets();
        auto found =
            std::find_if(shipped.begin(), shipped.end(), [&](auto& p) { return p.first == pathOrName; });
        auto effects = registry.names();
        if (found == shipped.end() && (isEffect || isFolder(path) ||
                                       std::find(effects.begin(), effects.end(), path) != effects.end())) {
            Chain chain;
            chain.steps.push_back(makeStep(registry.find(pathOrName)));
            chain.name = chain.steps[0].id;
            checkImages(chain, pathOrName);
            return chain;
        }
        if (found == shipped.end()) {
            for (const auto& [name, file] : shipped) effects.push_back(name);
            failUsage("no preset or effect '", pathOrName, "'",
                      isThere(path) ? "; for the file of that name here, say ./" + path
                                    : suggestion(pathOrName, effects));
        }
        path = found->second;
    }
    std::error_code none;
    auto size = fs::file_size(path, none);
    if (none)
        failUsage(path, ": no such preset file", suggestionBeside(path),
                  " (a shipped preset is named without path or ending)");
    if (size > (4u << 20)) failUsage(path, ": a preset of ", size, " bytes; at most 4 MiB");
    std::ifstream in(path, std::ios::binary);
    return parsePreset(std::string((std::istreambuf_iterator<char>(in)), {}), path, registry);
}

std::string writePreset(const Chain& chain) {
    ordered preset;
    preset["name"] = chain.name;
    if (!chain.description.empty()) preset["description"] = chain.description;
    if (chain.policy.sky == SkyPolicy::AtDistance) preset["sky"] = chain.policy.skyDistance;
    if (chain.policy.sky == SkyPolicy::Untouched) preset["sky"] = "untouched";
    if (chain.policy.unknown == UnknownDepth::Far) preset["unknown"] = "far";
    if (chain.policy.unknown == UnknownDepth::Keep) preset["unknown"] = "keep";
    if (chain.policy.smooth > 0) preset["smooth_depth"] = chain.policy.smooth;
    preset["effects"] = ordered::array();
    for (const auto& step : chain.steps) {
        ordered object;
        const auto& header = step.effect->header;
        object["effect"] = header.name;
        if (step.id != header.name) object["id"] = step.id;
        if (step.input != "color") object["input"] = step.input;
        if (step.output != "color") object["output"] = step.output;
        if (!step.enabled) object["enabled"] = false;
        for (const auto& parameter : header.parameters) {
            const auto& value = step.values.at(parameter.name);
            bool isMain = parameter.name == header.mainImage();
            if (!isMain && (step.given.count(parameter.name) || !(value == parameter.defaultValue)))
                object[parameter.name] = ordered::parse(shownJson(toJson(parameter, value)));
        }
        preset["effects"].push_back(object);
    }
    return preset.dump(2) + "\n";
}

namespace {

// effect.parameter or effect.list[0].field; the latter has a row.
struct ParameterPath {
    std::string step, name, row, field;
};

std::optional<ParameterPath> parseParameterPath(const std::string& path) {
    std::vector<std::string> words(1);
    std::string separators;
    for (char c : path)
        if (c == '.' || c == '[' || c == ']')
            separators += c, words.emplace_back();
        else
            words.back() += c;
    if ((separators != "." && separators != ".[].") || words[0].empty() || words[1].empty()) return {};
    if (separators == ".") return ParameterPath{words[0], words[1], "", ""};
    const bool isRow = !words[2].empty() && words[2].find_first_not_of("0123456789") == std::string::npos;
    if (!isRow || !words[3].empty() || words[4].empty()) return {};
    return ParameterPath{words[0], words[1], words[2], words[4]};
}

}  // namespace

void setParameter(Chain& chain, const std::string& path, const std::string& argument) {
    const std::optional<ParameterPath> parsed = parseParameterPath(path);
    if (!parsed) {
        std::vector<std::string> bare, whole;  // "visibility" without its effect
        for (const Step& candidate : chain.steps)
            for (const Parameter& p : candidate.effect->header.parameters)
                bare.push_back(p.name), whole.push_back(candidate.id + "." + p.name);
        const std::string near = nearestName(path.substr(0, path.find('[')), bare);
        std::string meant;
        for (size_t k = 0; k < bare.size() && !near.empty(); k++)
            if (bare[k] == near) meant += (meant.empty() ? "" : "' or '") + whole[k];
        failUsage("--set ", path, ": write effect.parameter=value or effect.list[0].field=value",
                  meant.empty() ? "" : " (did you mean '" + meant + "'?)");
    }
    const auto& [id, name, rowWord, fieldName] = *parsed;
    std::vector<std::string> ids, names;
    Step* step = nullptr;
    for (auto& candidate : chain.steps) {
        ids.push_back(candidate.id);
        if (candidate.id == id) step = &candidate;
    }
    if (!step) failUsage("--set ", path, ": the preset has no effect '", id, "'", suggestion(id, ids));
    const auto& parameters = step->effect->header.parameters;
    for (const auto& parameter : parameters) names.push_back(parameter.name);
    const Parameter* parameter = findParameter(parameters, name);
    if (!parameter)
        failUsage("--set ", path, ": ", id, " has no parameter '", name, "'", suggestion(name, names));
    step->given.insert(name);
    if (rowWord.empty()) {
        step->values[name] = parseArgument(*parameter, argument, "--set " + id);
        return;
    }
    if (parameter->type != ParameterType::List) failUsage("--set ", path, ": ", name, " is no list");
    auto& rows = step->values[name].rows;
    size_t row = rowWord.size() > 6 ? size_t(-1) : std::stoul(rowWord);
    if (row >= rows.size())
        failUsage("--set ", path, ": the list has ", rows.size(), " rows, counted from 0");
    names.clear();
    for (const auto& field : parameter->fields) names.push_back(field.name);
    const Parameter* field = findParameter(parameter->fields, fieldName);
    if (!field)
        failUsage("--set ", path, ": ", name, " has no field '", fieldName, "'",
                  suggestion(fieldName, names));
    rows[row][field->name] = parseArgument(*field, argument, "--set " + id + "." + name);
}

std::vector<std::pair<std::string, std::string>> shippedPresets() {
    std::vector<std::pair<std::string, std::string>> presets;
    std::error_code none;
    for (const auto& item : fs::directory_iterator(installRoot() + "/presets", none))
        if (item.path().extension() == ".json")
            presets.emplace_back(item.path().stem().string(), item.path().string());
    std::sort(presets.begin(), presets.end());
    return presets;
}

}  // namespace brume
