#include "effect/header.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>

#include "effect/sloppy_json.hpp"
#include "error.hpp"
#include "nearest_name.hpp"

namespace brume {

using json = nlohmann::json;

namespace {

// What is being parsed, for messages: "fog.fs: INPUTS[2] 'density'".
struct Where {
    std::string place;
    bool strict;  // brume's own form: unknown keys are mistakes; a foreign ISF file may say what it likes

    Where in(const std::string& part) const { return {place + ": " + part, strict}; }
    template <class... Parts>
    [[noreturn]] void fail(const Parts&... parts) const {
        failUsage(place, ": ", parts...);
    }
    void checkKeys(const json& object, const std::vector<std::string>& known) const {
        if (!strict) return;
        for (const auto& [key, item] : object.items())
            if (std::find(known.begin(), known.end(), key) == known.end())
                fail("unknown key '", key, "'", suggestion(key, known));
    }
};

std::string textOf(const json& object, const char* key, const Where& where) {
    auto found = object.find(key);
    if (found == object.end() || found->is_null()) return {};
    if (found->is_string()) return found->get<std::string>();
    if (!where.strict) return found->dump();
    where.fail(key, " must be text");
}

bool flagOf(const json& object, const char* key) {
    auto found = object.find(key);
    if (found == object.end()) return false;
    if (found->is_boolean()) return found->get<bool>();
    if (found->is_number()) return found->get<double>() != 0;
    if (!found->is_string()) return false;
    std::string word = found->get<std::string>();
    std::transform(word.begin(), word.end(), word.begin(), [](unsigned char c) { return std::tolower(c); });
    return word == "1" || word == "true" || word == "yes";
}

// Foreign files may leave out the dollar of a name.
std::string withDollars(const std::string& expression) {
    static const std::regex bare(R"((^|[^$\w.])([A-Za-z_]\w*)(?!\s*\(|\w))");
    return std::regex_replace(expression, bare, "$1$$$2");
}

SizeExpression expressionOf(const json& object, const char* key, const Where& where) {
    auto found = object.find(key);
    if (found == object.end() || found->is_null()) return {};
    if (!where.strict && found->is_string() &&
        found->get<std::string>().find_first_not_of(" \t\n") == std::string::npos)
        return {};
    try {
        if (found->is_number()) return SizeExpression(found->dump());
        if (found->is_boolean()) return SizeExpression(found->get<bool>() ? "1" : "0");
        if (found->is_string())
            return SizeExpression(where.strict ? found->get<std::string>()
                                               : withDollars(found->get<std::string>()));
    } catch (const Error& error) {
        where.fail(key, ": ", error.what());
    }
    where.fail(key, " must be a number or a size expression");
}

// --- parameters ----------------------------------------------------------------------------------

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
            numbers.push_back(std::atof(item.get<std::string>().c_str()));
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
    for (const auto& value : *values) {
        if (value.is_number())
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

Parameter readParameter(const json& object, const Where& outer, bool isField) {
    if (!object.is_object()) outer.fail("each must be an object");
    Parameter parameter;
    parameter.name = textOf(object, "NAME", outer);
    if (parameter.name.empty()) outer.fail("NAME is missing");
    Where where = outer.in("'" + parameter.name + "'");
    where.checkKeys(object,
                    {"NAME", "TYPE", "LABEL", "UNIT", "HINT", "GROUP", "DEFAULT", "MIN", "MAX", "UI_MIN",
                     "UI_MAX", "VALUES", "LABELS", "AUTO", "FIELDS", "MAX_ROWS", "SIDECAR", "IDENTITY"});
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

    if (parameter.type == ParameterType::List) {
        auto fields = object.find("FIELDS");
        if (fields == object.end() || !fields->is_array() || fields->empty())
            where.fail("a list needs FIELDS, an array of parameters");
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

// --- passes, derived, tolerance ------------------------------------------------------------------

Pass readPass(const json& object, const Where& where) {
    if (!object.is_object()) {
        if (where.strict) where.fail("each must be an object");
        return {};
    }
    where.checkKeys(object, {"TARGET", "WIDTH", "HEIGHT", "FLOAT", "PERSISTENT", "WHEN", "REPEAT", "COMPUTE",
                             "DESCRIPTION"});
    Pass pass;
    pass.target = textOf(object, "TARGET", where);
    pass.width = expressionOf(object, "WIDTH", where);
    pass.height = expressionOf(object, "HEIGHT", where);
    pass.isFloat = flagOf(object, "FLOAT") || where.strict;
    pass.persistent = flagOf(object, "PERSISTENT");
    pass.when = expressionOf(object, "WHEN", where);
    pass.repeat = expressionOf(object, "REPEAT", where);
    if (auto compute = object.find("COMPUTE"); compute != object.end()) {
        where.in("COMPUTE").checkKeys(*compute, {"LOCAL_SIZE", "OVER"});
        pass.compute.emplace();
        if (auto size = compute->find("LOCAL_SIZE"); size != compute->end()) {
            if (!size->is_array() || size->empty() || size->size() > 3)
                where.fail("LOCAL_SIZE must be an array of 1 to 3 numbers");
            for (size_t k = 0; k < 3; k++)
                pass.compute->localSize[k] = k < size->size() ? (*size)[k].get<int>() : 1;
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
    derived.name = textOf(object, "NAME", outer);
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

int lineAt(const std::string& text, size_t place) {
    return 1 + int(std::count(text.begin(), text.begin() + std::min(place, text.size()), '\n'));
}

// The JSON sits in the first comment that begins with a brace; the GLSL is everything after it. The comment
// comes back as it lies in the file, blank up to the brace.
std::pair<std::string, size_t> splitComment(const std::string& path, const std::string& text) {
    size_t begin = text.find("/*");
    if (begin == std::string::npos)
        failUsage(path,
                  ": no /* { ... } */ comment at the top; an ISF file begins with its JSON description");
    while (begin != std::string::npos) {
        const size_t end = text.find("*/", begin);
        if (end == std::string::npos)
            failUsage(path, ":", lineAt(text, begin), ": the comment is never closed");
        const size_t brace = text.find_first_not_of(" \t\r\n", begin + 2);
        if (text[brace] == '{') {
            std::string comment = text.substr(0, end);
            for (size_t k = 0; k < brace; k++)
                if (comment[k] != '\n') comment[k] = ' ';
            return {comment, end + 2};
        }
        begin = text.find("/*", end);
    }
    failUsage(path, ": no comment holds a JSON object { ... }; an ISF file begins with its JSON description");
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
        const std::string path = textOf(item, "PATH", where);
        if (path.empty()) where.in("IMPORTED").fail("'", name, "': PATH is missing");
        header.imported.push_back({name, (folder / path).string()});
    }
}

// The description, as JSON or, in a foreign file, as what it evidently means.
json parseDescription(const std::string& path, const std::string& fileText, const std::string& comment) {
    try {
        return json::parse(comment, nullptr, true, true);
    } catch (const json::parse_error& error) {
        const json repaired = json::parse(repairJson(comment), nullptr, false, true);
        if (repaired.is_object() && !repaired.contains("SPACE")) return repaired;
        failUsage(path, ":", lineAt(fileText, error.byte), ": the description is not JSON: ", error.what());
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
                     "SPACE", "POINTWISE", "WRITES", "DERIVED", "TOLERANCE", "CHART", "BREAKS"});
    try {
        header.description = textOf(object, "DESCRIPTION", where);
        header.credit = textOf(object, "CREDIT", where);
        if (auto list = object.find("CATEGORIES"); list != object.end() && list->is_array())
            for (const auto& item : *list)
                if (item.is_string()) header.categories.push_back(item.get<std::string>());
        if (auto list = object.find("BREAKS"); list != object.end())
            for (const auto& item : *list) header.breaks.push_back(item.get<std::string>());
        auto inputs = object.find("INPUTS");
        if (inputs != object.end() && !where.strict)
            header.parameters = readForeignInputs(*inputs, where.in("INPUTS"));
        else if (inputs != object.end() && inputs->is_array())
            for (const auto& input : *inputs)
                header.parameters.push_back(readParameter(input, where.in("INPUTS"), false));
        if (auto passes = object.find("PASSES"); passes != object.end() && passes->is_array())
            for (size_t k = 0; k < passes->size(); k++)
                header.passes.push_back(
                    readPass((*passes)[k], where.in("PASSES[" + std::to_string(k) + "]")));
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
            header.chart = std::make_shared<const json>(*item);
    } catch (const json::exception& error) {
        where.fail("a value has the wrong type: ", error.what());
    }
    if (where.strict) {
        checkNamesDiffer(header, where);
        checkDerivedSources(header, where);
        if (!header.passes.back().target.empty())
            where.fail("the last pass must have no TARGET: it writes the output");
    }
    return header;
}

EffectHeader readHeader(const std::string& path) {
    std::error_code none;
    auto size = std::filesystem::file_size(path, none);
    if (none) failUsage(path, ": no such effect file");
    if (size > (4u << 20)) failUsage(path, ": an effect file of ", size, " bytes; at most 4 MiB");
    std::ifstream in(path, std::ios::binary);
    std::string content((std::istreambuf_iterator<char>(in)), {});
    if (!in) failUsage(path, ": cannot be read");
    return parseHeader(path, content);
}

std::string EffectHeader::mainImage() const {
    const Parameter* main = findParameter(parameters, "inputImage");
    if (!main) main = findParameter(parameters, "startImage");  // a transition's first
    return main && main->type == ParameterType::Image ? main->name : std::string();
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
