// Loading an effect: its header, and its plugin from a private copy of the shared object.
#include <dlfcn.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "effect/effect.hpp"
#include "effect/guarded_plugin.hpp"
#include "effect/missing_half.hpp"
#include "error.hpp"
#include "nearest_name.hpp"

namespace brume {

namespace fs = std::filesystem;

namespace {

// A loaded object is never dlclosed (code may still run, and statics keep it alive anyway); a rebuilt plugin
// has to come from another file to be loaded at all, so each load is of a fresh copy, unlinked at once.
const PluginEntry* openPlugin(const std::string& library) {
    std::string copy = (fs::temp_directory_path() / "brume-plugin-XXXXXX").string();
    int file = mkstemp(copy.data());
    if (file < 0)
        failIo(fs::temp_directory_path().string(), ": cannot be written; set TMPDIR to a folder that can");
    ::close(file);
    std::error_code failed;
    fs::copy_file(library, copy, fs::copy_options::overwrite_existing, failed);
    void* handle = failed ? nullptr : dlopen(copy.c_str(), RTLD_NOW | RTLD_LOCAL);
    std::string reason = failed ? failed.message() : handle ? "" : dlerror();
    fs::remove(copy, failed);
    if (!handle) failUsage(library, ": cannot be loaded: ", reason);
    auto* entry = static_cast<const PluginEntry*>(dlsym(handle, "brume_plugin"));
    if (!entry) failUsage(library, ": is no brume plugin (it exports no brume_plugin; use BRUME_PLUGIN)");
    if (entry->interfaceVersion != pluginInterfaceVersion)
        failUsage(library, ": was built for plugin interface ", entry->interfaceVersion, ", this brume has ",
                  pluginInterfaceVersion, "; rebuild the plugin");
    if (std::string(entry->opencvVersion) != CV_VERSION)
        failUsage(library, ": was built with OpenCV ", entry->opencvVersion, ", this brume with ", CV_VERSION,
                  "; rebuild the plugin");
    return entry;
}

bool matches(ParameterType header, ParameterType bound) {
    if (header == ParameterType::Event) return bound == ParameterType::Bool;
    if (header == ParameterType::Color)
        return bound == ParameterType::Color || bound == ParameterType::Point3D;
    return header == bound;
}

const char* fieldTypeOf(ParameterType type) {
    switch (type) {
        case ParameterType::Event:
        case ParameterType::Bool:
            return "bool";
        case ParameterType::Long:
            return "int";
        case ParameterType::Float:
            return "float";
        case ParameterType::Point2D:
            return "cv::Vec2f";
        case ParameterType::Point3D:
            return "cv::Vec3f";
        case ParameterType::Color:
            return "cv::Vec4f or cv::Vec3f";
        default:
            return "std::vector";
    }
}

// Every number the header declares must be bound, and nothing else.
void checkBindings(const EffectHeader& header, const PluginEffect& plugin, const std::string& library) {
    std::map<std::string, ParameterType> declared;
    for (const auto& parameter : header.parameters) {
        if (componentCount(parameter.type) > 0 || parameter.type == ParameterType::List)
            declared[parameter.name] = parameter.type;
        for (const auto& field : parameter.fields) declared[parameter.name + "." + field.name] = field.type;
    }
    std::vector<std::string> names;
    for (const auto& [name, type] : declared) names.push_back(name);
    std::set<std::string> bound;
    for (const auto& [name, type] : plugin.bound()) {
        auto found = declared.find(name);
        if (found == declared.end())
            failUsage(library, ": binds '", name, "', which ", header.path, " does not declare",
                      suggestion(name, names));
        if (!matches(found->second, type))
            failUsage(library, ": binds '", name, "' to another type than ", header.path,
                      " declares; it needs ", fieldTypeOf(found->second));
        if (!bound.insert(name).second) failUsage(library, ": binds '", name, "' twice");
    }
    for (const auto& name : names)
        if (!bound.count(name))
            failUsage(library, ": does not bind '", name, "', which ", header.path, " declares");
}

void checkFunctions(const EffectHeader& header, const PluginEffect& plugin, const std::string& library) {
    std::set<std::string> computed;
    for (const auto& name : plugin.derivedNames()) computed.insert(name);
    for (const auto& derived : header.derived)
        if (!computed.erase(derived.name))
            failUsage(library, ": has no derive function for '", derived.name, "', which ", header.path,
                      " declares");
    if (!computed.empty())
        failUsage(library, ": derives '", *computed.begin(), "', which ", header.path,
                  " does not declare in DERIVED");
    if (header.pointwise && !plugin.hasRows())
        failUsage(library, ": ", header.path, " says POINTWISE, so the plugin must offer rows");
    if (!header.pointwise && !plugin.hasRun())
        failUsage(library, ": must offer run (or rows, with \"POINTWISE\": true in ", header.path, ")");
    for (const auto& parameter : header.parameters)
        if (parameter.allowsAuto && parameter.type == ParameterType::Long && !plugin.hasPlan())
            failUsage(library, ": '", parameter.name, "' may be \"auto\", so the plugin must offer plan");
}

}  // namespace

std::shared_ptr<const Effect> loadEffect(const std::string& fsPath, const std::string& libraryPath,
                                         const std::vector<std::string>& includePath) {
    auto effect = std::make_shared<Effect>();
    effect->header = readHeader(fsPath);
    effect->includePath = includePath;
    if (libraryPath.empty()) {
        if (!effect->header.derived.empty())
            failUsage(fsPath, ": declares DERIVED, which needs its plugin ", effect->header.name,
                      ".so beside it", unbuiltSource(fsPath).empty() ? "" : "; " + unbuiltSource(fsPath));
        return effect;
    }
    if (!effect->header.linear) failUsage(fsPath, ": an effect with a plugin needs \"SPACE\": \"linear\"");
    auto plugin = makePlugin(*openPlugin(libraryPath), libraryPath);
    checkBindings(effect->header, *plugin, libraryPath);
    checkFunctions(effect->header, *plugin, libraryPath);
    effect->plugin = std::move(plugin);
    return effect;
}

}  // namespace brume
