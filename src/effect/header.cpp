#include "effect/header.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "effect/header_chart.hpp"
#include "effect/header_parts.hpp"
#include "nearest_name.hpp"
#include "strict_json.hpp"

namespace brume {

using json = nlohmann::json;

namespace {

Pass readPass(const json& object, const Where& where) {
    if (!object.is_object()) {
        if (where.strict) where.fail("each must be an object");
        return {};
    }
    where.checkKeys(object, {"TARGET", "WIDTH", "HEIGHT", "FLOAT", "PERSISTENT", "WHEN", "REPEAT", "COMPUTE",
                             "DESCRIPTION"});
    Pass pass;
    pass.target = nameOf(object, "TARGET", where);
    pass.width = expressionOf(object, "WIDTH", where);
    pass.height = expressionOf(object, "HEIGHT", where);
    pass.isFloat = flagOf(object, "FLOAT") || where.strict;
    pass.persistent = flagOf(object, "PERSISTENT");
    pass.when = expressionOf(object, "WHEN", where);
    pass.repeat = expressionOf(object, "REPEAT", where);
    if (auto compute = object.find("COMPUTE"); compute != object.end()) {
        where.in("COMPUTE").checkKeys(*compute, {"LOCAL_SIZE", "OVER"});
        pass.compute = Pass::Compute();
        if (auto size = compute->find("LOCAL_SIZE"); size != compute->end()) {
            if (!size->is_array() || size->empty() || size->size() > 3)
                where.fail("LOCAL_SIZE must be an array of 1 to 3 numbers");
            for (size_t k = 0; k < 3; k++) {
                const double one = k < size->size() ? (*size)[k].get<double>() : 1;
                if (!(one >= 1 && one <= 1024)) where.fail("LOCAL_SIZE must be numbers of 1 to 1024");
                pass.compute->localSize[k] = int(one);
            }
            int product =
                pass.compute->localSize[0] * pass.compute->localSize[1] * pass.compute->localSize[2];
            if (product < 1 || product > 1024) where.fail("LOCAL_SIZE must multiply to 1 to 1024");
        }
        if (auto over = compute->find("OVER"); over != compute->end()) {
            if (!over->is_array() || over->size() != 2) where.fail("OVER must be two size expressions");
            for (size_t k = 0; k < 2; k++)
                pass.compute->over[k] = expressionOf(json{{"OVER", (*over)[k]}}, "OVER", where);
        }
    }
    return pass;
}

Derived readDerived(const json& object, const Where& outer) {
    static const std::vector<std::pair<std::string, Derived::Type>> types = {
        {"float", Derived::Type::Float},  {"int", Derived::Type::Int},
        {"vec2", Derived::Type::Vec2},    {"vec3", Derived::Type::Vec3},
        {"vec4", Derived::Type::Vec4},    {"mat4", Derived::Type::Mat4},
        {"array", Derived::Type::Array},  {"vec4 array", Derived::Type::Vec4Array},
        {"volume", Derived::Type::Volume}};
    if (!object.is_object()) outer.fail("each must be an object");
    Derived derived;
    derived.name = nameOf(object, "NAME", outer);
    if (derived.name.empty()) outer.fail("NAME is missing");
    Where where = outer.in("'" + derived.name + "'");
    where.checkKeys(object, {"NAME", "TYPE", "SIZE", "FROM", "DESCRIPTION"});
    std::string typeName = textOf(object, "TYPE", where);
    std::vector<std::string> known;
    for (const auto& [name, type] : types) known.push_back(name);
    auto type = std::find_if(types.begin(), types.end(), [&](auto& t) { return t.first == typeName; });
    if (type == types.end()) where.fail("unknown TYPE '", typeName, "'", suggestion(typeName, known));
    derived.type = type->second;
    if (auto size = object.find("SIZE"); size != object.end()) {
        json array = size->is_array() ? *size : json::array({*size});
        for (const auto& item : array)
            derived.size.push_back(expressionOf(json{{"SIZE", item}}, "SIZE", where));
    }
    bool isArray = derived.type == Derived::Type::Array || derived.type == Derived::Type::Vec4Array;
    size_t wanted = derived.type == Derived::Type::Volume ? 3 : isArray ? 1 : 0;
    if (derived.size.size() != wanted) where.fail("SIZE needs ", wanted, " expressions");
    auto from = object.find("FROM");
    if (from == object.end() || !from->is_array()) where.fail("FROM must list what it is computed from");
    for (const auto& name : *from) derived.from.push_back(name.get<std::string>());
    return derived;
}

Tolerance readTolerance(const json& object, const Where& where) {
    where.checkKeys(object, {"ABS", "REL", "REFERENCE", "MEASURED", "REASON"});
    Tolerance tolerance;
    tolerance.abs = object.value("ABS", tolerance.abs);
    tolerance.rel = object.value("REL", tolerance.rel);
    tolerance.reference = object.value("REFERENCE", tolerance.reference);
    tolerance.measured = object.value("MEASURED", tolerance.measured);
    tolerance.reason = object.value("REASON", "");
    return tolerance;
}

// ISF version 1 named its persistent buffers, with their sizes, outside PASSES.
void readPersistentBuffers(const json& buffers, EffectHeader& header, const Where& where) {
    for (const auto& [key, item] : buffers.items()) {
        const std::string name = item.is_string()     ? item.get<std::string>()
                                 : buffers.is_array() ? (item.is_object() ? textOf(item, "NAME", where) : "")
                                                      : key;
        for (Pass& pass : header.passes) {
            if (name.empty() || pass.target != name) continue;
            pass.persistent = true;
            if (!item.is_object()) continue;
            if (pass.width.empty()) pass.width = expressionOf(item, "WIDTH", where);
            if (pass.height.empty()) pass.height = expressionOf(item, "HEIGHT", where);
            pass.isFloat |= flagOf(item, "FLOAT");
        }
    }
}

void readImported(const json& imported, EffectHeader& header, const Where& where) {
    const auto folder = std::filesystem::path(header.path).parent_path();
    for (const auto& [key, item] : imported.items()) {
        if (!item.is_object() && !where.strict) continue;
        std::string name = textOf(item, "NAME", where);
        if (name.empty() && !imported.is_array()) name = key;
        if (name.empty()) where.in("IMPORTED").fail("NAME is missing");
        if (item.contains("PATH") && item["PATH"].is_array())
            where.in("IMPORTED")
                .fail("'", name, "' is a cube map of ", item["PATH"].size(),
                      " images; brume reads one image a name");
        const std::string path = textOf(item, "PATH", where);
        if (path.empty()) where.in("IMPORTED").fail("'", name, "': PATH is missing");
        header.imported.push_back({name, (folder / path).string()});
    }
}

void checkNamesDiffer(const EffectHeader& header, const Where& where) {
    std::vector<std::string> names;
    for (const auto& parameter : header.parameters) names.push_back(parameter.name);
    for (const auto& derived : header.derived) names.push_back(derived.name);
    std::sort(names.begin(), names.end());
    auto twice = std::adjacent_find(names.begin(), names.end());
    if (twice != names.end()) where.fail("'", *twice, "' is declared twice");
}

void checkDerivedSources(const EffectHeader& header, const Where& where) {
    std::vector<std::string> known = {"camera", "size", "time", "frame", "sidecar"};
    for (const auto& parameter : header.parameters) known.push_back(parameter.name);
    for (const auto& derived : header.derived)
        for (const auto& from : derived.from)
            if (std::find(known.begin(), known.end(), from) == known.end())
                where.fail("DERIVED '", derived.name, "': FROM names '", from, "'", suggestion(from, known));
}

void checkConditions(const EffectHeader& header, const Where& where) {
    std::vector<std::string> known;
    for (const auto& [name, value] : expressionVariables(header, defaultValues(header.parameters)))
        known.push_back(name);
    for (const auto& parameter : header.parameters)
        for (const std::string& name : parameter.when.names())
            if (std::find(known.begin(), known.end(), name) == known.end())
                where.in("INPUTS")
                    .in("'" + parameter.name + "'")
                    .fail("WHEN names $", name, suggestion(name, known));
}

}  // namespace

EffectHeader parseHeader(const std::string& path, const std::string& fileText) {
    auto [comment, bodyBegin] = splitComment(path, fileText);
    const json object = parseDescription(path, fileText, comment);
    if (!object.is_object()) failUsage(path, ": the description must be a JSON object");

    EffectHeader header;
    header.path = path;
    header.name = std::filesystem::path(path).stem().string();
    header.body = fileText.substr(bodyBegin);
    header.bodyLine = lineAt(fileText, bodyBegin);

    Where where{path, object.contains("SPACE")};
    if (where.strict && object["SPACE"] != "linear")
        where.fail("SPACE must be \"linear\" (or be left out: plain ISF)");
    header.linear = where.strict;
    where.checkKeys(object,
                    {"ISFVSN", "VSN", "DESCRIPTION", "CREDIT", "CATEGORIES", "INPUTS", "PASSES", "IMPORTED",
                     "SPACE", "POINTWISE", "WRITES", "DERIVED", "TOLERANCE", "CHART", "STABILITY", "BREAKS"});
    try {
        header.description = textOf(object, "DESCRIPTION", where);
        header.credit = textOf(object, "CREDIT", where);
        if (auto list = object.find("CATEGORIES"); list != object.end() && list->is_array())
            for (const auto& item : *list)
                if (item.is_string()) header.categories.push_back(item.get<std::string>());
        if (auto list = object.find("BREAKS"); list != object.end())
            for (const auto& item : *list) header.breaks.push_back(item.get<std::string>());
        auto inputs = object.find("INPUTS");
        if (inputs != object.end()) checkCount(*inputs, "INPUTS", mostParameters, where);
        if (inputs != object.end() && !where.strict)
            header.parameters = readForeignInputs(*inputs, where.in("INPUTS"));
        else if (inputs != object.end() && inputs->is_array())
            for (const auto& input : *inputs)
                header.parameters.push_back(readParameter(input, where.in("INPUTS"), false));
        if (auto passes = object.find("PASSES"); passes != object.end() && passes->is_array()) {
            checkCount(*passes, "PASSES", mostPasses, where);
            for (size_t k = 0; k < passes->size(); k++)
                header.passes.push_back(
                    readPass((*passes)[k], where.in("PASSES[" + std::to_string(k) + "]")));
        }
        if (header.passes.empty()) header.passes.emplace_back();
        if (auto buffers = object.find("PERSISTENT_BUFFERS"); buffers != object.end() && !where.strict)
            readPersistentBuffers(*buffers, header, where.in("PERSISTENT_BUFFERS"));
        if (auto list = object.find("IMPORTED"); list != object.end()) readImported(*list, header, where);
        if (auto list = object.find("DERIVED"); list != object.end())
            for (const auto& item : *list) header.derived.push_back(readDerived(item, where.in("DERIVED")));
        if (auto writes = object.find("WRITES"); writes != object.end())
            for (const auto& item : *writes) {
                if (item != "transmittance") where.fail("WRITES may only hold \"transmittance\"");
                header.writesTransmittance = true;
            }
        header.pointwise = flagOf(object, "POINTWISE");
        if (auto item = object.find("TOLERANCE"); item != object.end())
            header.tolerance = readTolerance(*item, where.in("TOLERANCE"));
        if (auto item = object.find("CHART"); item != object.end())
            header.chart = std::make_shared<const Chart>(readChart(*item, header, where.in("CHART")));
        if (auto item = object.find("STABILITY"); item != object.end())
            header.stability = std::make_shared<const json>(*item);
    } catch (const json::exception& error) {
        where.fail("a value has the wrong type: ", reasonOf(error));
    }
    if (where.strict) {
        checkNamesDiffer(header, where);
        checkDerivedSources(header, where);
        checkConditions(header, where);
        if (!header.passes.back().target.empty())
            where.fail("the last pass must have no TARGET: it writes the output");
    }
    return header;
}

EffectHeader readHeader(const std::string& path) {
    std::error_code none;
    auto size = std::filesystem::file_size(path, none);
    if (none) failUsage(path, ": no such effect file", suggestionBeside(path));
    if (size > (4u << 20)) failUsage(path, ": an effect file of ", size, " bytes; at most 4 MiB");
    std::ifstream in(path, std::ios::binary);
    std::string content((std::istreambuf_iterator<char>(in)), {});
    if (!in) failUsage(path, ": cannot be read");
    return parseHeader(path, content);
}

std::string EffectHeader::mainImage() const {
    const Parameter* main = findParameter(parameters, "inputImage");
    if (!main) main = findParameter(parameters, "startImage");  // a transition's first
    if (main && main->type == ParameterType::Image) return main->name;
    // A foreign file may call it anything.
    for (const Parameter& parameter : parameters)
        if (!linear && parameter.type == ParameterType::Image) return parameter.name;
    return {};
}

std::map<std::string, double> expressionVariables(const EffectHeader& header, const ParameterValues& values) {
    std::map<std::string, double> variables;
    for (const auto& parameter : header.parameters) {
        for (size_t k = 0; k < parameter.values.size(); k++)
            variables[parameter.choiceIdentifier(k)] = double(parameter.values[k]);
        auto found = values.find(parameter.name);
        if (found == values.end()) continue;
        if (componentCount(parameter.type) == 1) variables[parameter.name] = found->second.numbers[0];
        if (parameter.type == ParameterType::List)
            variables[parameter.name + "_count"] = found->second.rows.size();
    }
    return variables;
}

}  // namespace brume
