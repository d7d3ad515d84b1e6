// Depth encodings as people state them: ready-made names, the sidecar's keys, "opengl:near=.1,far=100".
#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>

#include "error.hpp"
#include "frame/depth_encoding.hpp"
#include "frame/key_values.hpp"
#include "frame/sidecar.hpp"
#include "nearest_name.hpp"
#include "strict_json.hpp"

namespace brume {

namespace {

using Kind = DepthEncoding::Kind;
using nlohmann::json;

struct ReadyMade {
    const char* name;
    DepthEncoding encoding;
    const char* required;  ///< keys that a capture must state, "" for none
};

DepthEncoding linear(double scale, std::vector<double> unknown, bool zeroIsSky = false) {
    DepthEncoding e;
    e.scaleToMetres = scale;
    e.unknown = std::move(unknown);
    e.zeroIsSky = zeroIsSky;
    return e;
}

DepthEncoding sensor(double scale, double reach) {
    DepthEncoding e = linear(scale, {0});
    e.sensorReach = reach;
    return e;
}

DepthEncoding ofKind(Kind kind, std::vector<double> unknown = {}) {
    DepthEncoding e;
    e.kind = kind;
    e.unknown = std::move(unknown);
    return e;
}

const std::vector<ReadyMade>& readyMade() {
    const double inf = DepthEncoding::infinity;
    static const std::vector<ReadyMade> all = {
        {"linear", linear(1, {}), ""},
        {"device", ofKind(Kind::Device), "near far"},
        {"disparity", ofKind(Kind::Disparity), "focal_baseline"},
        {"inverse", ofKind(Kind::Inverse), ""},
        {"blender", linear(1, {}), ""},        // 1e10 where nothing is
        {"tum", sensor(1 / 5000., 10), ""},    // RGB-D benchmark: a Kinect, 5000 a metre
        {"kitti", sensor(1 / 256., 125), ""},  // depth completion: a lidar, 256 a metre
        {"sintel", linear(1, {}), ""},         // .dpt
        {"middlebury", ofKind(Kind::Disparity, {inf}), "focal_baseline"},  // PFM; "offset" is its doffs
        {"kinect", sensor(.001, 10), ""},                                  // as SDKs and data sets save it
        {"realsense", sensor(.001, 20), ""},                               // the SDK's default unit
        {"metres", linear(1, {0}), ""},
        {"millimetres", linear(.001, {0}), ""},
        {"unreal", linear(.01, {}, true), ""},  // world depth in cm
        {"opengl", ofKind(Kind::Device), "near far"},
        {"direct3d", ofKind(Kind::Device), "near far"},
        {"vulkan", ofKind(Kind::Device), "near far"},
        {"reshade", ofKind(Kind::Reshade), "near far"},
    };
    return all;
}

const std::vector<std::string> keys = {
    "encoding",  "file",    "scale_to_metres", "near",           "far",        "metres_per_unit",
    "reversed",  "range",   "reshade_far",     "focal_baseline", "scale",      "offset",
    "along_ray", "unknown", "sky_at_or_above", "sky_beyond",     "zero_is_sky"};

/// A number, or "infinite".
double number(const json& value, const std::string& key, const std::string& where) {
    if (value.is_number()) return value.get<double>();
    if (value.is_string() && (value == "inf" || value == "infinite")) return DepthEncoding::infinity;
    failIo(where, ": ", key, " is ", shownJson(value), ", not a number");
}

bool flag(const json& value, const std::string& key, const std::string& where) {
    if (!value.is_boolean()) failIo(where, ": ", key, " is ", shownJson(value), ", not true or false");
    return value.get<bool>();
}

void requireSense(const DepthEncoding& e, const std::string& where) {
    const auto positive = [&](double value, const char* key) {
        if (!(value > 0)) failIo(where, ": ", key, " is ", value, ", not above 0");
    };
    positive(e.scaleToMetres, "scale_to_metres");
    positive(e.metresPerUnit, "metres_per_unit");
    positive(e.nearPlane, "near");
    positive(e.focalBaseline, "focal_baseline");
    if (e.disparityScale == 0) failIo(where, ": scale is 0");
    if (!(e.farPlane > e.nearPlane))
        failIo(where, ": far (", e.farPlane, ") is not beyond near (", e.nearPlane, ")");
    if (e.range && (*e.range)[0] == (*e.range)[1]) failIo(where, ": range spans nothing");
    if (!(e.reshadeFar > 1)) failIo(where, ": reshade_far is ", e.reshadeFar, ", not above 1");
}

const char* kindName(Kind kind) {
    switch (kind) {
        case Kind::Linear:
            return "linear depth";
        case Kind::Disparity:
            return "disparity";
        case Kind::Inverse:
            return "inverse depth";
        default:
            return "a depth buffer";
    }
}

/// What a key scales by in another kind; a key that would be ignored leaves depth wrong without a word.
void requireMeaning(Kind kind, const std::string& key, const std::string& where) {
    struct Use {
        const char* key;
        std::vector<Kind> kinds;
    };
    static const std::vector<Use> uses = {
        {"scale_to_metres", {Kind::Linear}},
        {"sky_at_or_above", {Kind::Linear}},
        {"zero_is_sky", {Kind::Linear}},
        {"metres_per_unit", {Kind::Device, Kind::Reshade}},
        {"reversed", {Kind::Device, Kind::Reshade}},
        {"range", {Kind::Device, Kind::Reshade}},
        {"reshade_far", {Kind::Reshade}},
        {"focal_baseline", {Kind::Disparity}},
        {"scale", {Kind::Disparity, Kind::Inverse}},
        {"offset", {Kind::Disparity, Kind::Inverse}},
    };
    const auto use = std::find_if(uses.begin(), uses.end(), [&](const Use& u) { return key == u.key; });
    if (use == uses.end() || std::find(use->kinds.begin(), use->kinds.end(), kind) != use->kinds.end())
        return;
    const bool scales =
        key == "scale" || key == "scale_to_metres" || key == "metres_per_unit" || key == "focal_baseline";
    const char* own = kind == Kind::Linear      ? "scale_to_metres"
                      : kind == Kind::Disparity ? "focal_baseline"
                      : kind == Kind::Inverse   ? "scale"
                                                : "metres_per_unit";
    failIo(where, ": ", key, " says nothing of ", kindName(kind),
           scales ? text(" (did you mean ", own, "?)") : "");
}

}  // namespace

std::vector<std::string> depthEncodingNames() {
    std::vector<std::string> names;
    for (const ReadyMade& r : readyMade()) names.push_back(r.name);
    return names;
}

std::vector<std::string> sensorEncodingNames() {
    std::vector<std::string> names;
    for (const ReadyMade& r : readyMade())
        if (std::isfinite(r.encoding.sensorReach)) names.push_back(r.name);
    return names;
}

// A unit's sign is too short to resemble a name.
static std::string encodingSuggestion(const std::string& name) {
    for (const auto& [sign, meant] :
         {std::pair{"mm", "millimetres"}, {"m", "metres"}, {"cm", "linear:scale_to_metres=.01"}})
        if (name == sign) return text(" (did you mean '", meant, "'?)");
    return suggestion(name, depthEncodingNames());
}

DepthEncoding depthEncodingFromJson(const json& object, const std::string& where) {
    if (!object.is_object()) failIo(where, ": must be an object");
    if (object.contains("encoding") && !object["encoding"].is_string())
        failIo(where, ": encoding is ", shownJson(object["encoding"]), ", not a name");
    const std::string name = object.value("encoding", "linear");
    const ReadyMade* base = nullptr;
    for (const ReadyMade& r : readyMade())
        if (name == r.name) base = &r;
    if (!base) failIo(where, ": there is no depth encoding ", name, encodingSuggestion(name));
    DepthEncoding e = base->encoding;
    std::istringstream required(base->required);
    for (const auto& [key, value] : object.items())
        if (std::find(keys.begin(), keys.end(), key) == keys.end())
            failIo(where, ": there is no key ", key, suggestion(key, keys));
    std::string missing, example;
    for (std::string key; required >> key;) {
        if (!object.contains(key)) missing += (missing.empty() ? "" : " and ") + key;
        example += text(example.empty() ? "" : ",", key, "=", key == "near" ? ".1" : "1000");
    }
    if (!missing.empty())
        failIo(where, ": the encoding ", name, " needs ", missing, ", as in '", name, ":", example, "' (",
               base->encoding.kind == Kind::Disparity
                   ? "focal length in px times the distance of the two cameras in m"
                   : "the planes of the projection that drew the frame; the game or its matrix says them",
               ")");
    for (const auto& [key, value] : object.items()) {
        requireMeaning(e.kind, key, where);
        if (key == "encoding" || key == "file")
            continue;
        else if (key == "scale_to_metres")
            e.scaleToMetres = number(value, key, where);
        else if (key == "near")
            e.nearPlane = number(value, key, where);
        else if (key == "far")
            e.farPlane = number(value, key, where);
        else if (key == "metres_per_unit")
            e.metresPerUnit = number(value, key, where);
        else if (key == "reversed")
            e.reversed = flag(value, key, where);
        else if (key == "reshade_far")
            e.reshadeFar = number(value, key, where);
        else if (key == "focal_baseline")
            e.focalBaseline = number(value, key, where);
        else if (key == "scale")
            e.disparityScale = number(value, key, where);
        else if (key == "offset")
            e.disparityOffset = number(value, key, where);
        else if (key == "along_ray")
            e.alongRay = flag(value, key, where);
        else if (key == "sky_at_or_above")
            e.skyAtOrAbove = number(value, key, where);
        else if (key == "sky_beyond")
            e.skyBeyond = number(value, key, where);
        else if (key == "zero_is_sky")
            e.zeroIsSky = flag(value, key, where);
        else if (key == "range") {
            if (!value.is_array() || value.size() != 2)
                failIo(where, ": range is ", shownJson(value), ", not the two numbers stored for 0 and 1");
            e.range = {number(value[0], key, where), number(value[1], key, where)};
        } else if (key == "unknown") {
            e.unknown.clear();
            for (const json& v : value.is_array() ? value : json::array({value}))
                e.unknown.push_back(number(v, key, where));
        }
    }
    requireSense(e, where);
    return e;
}

DepthEncoding parseDepthEncoding(const std::string& text) {
    const size_t colon = text.find(':');
    const std::string name = text.substr(0, colon);
    for (const std::string& known : depthEncodingNames())
        if (name.size() > known.size() && name.starts_with(known) &&
            !std::isalnum(static_cast<unsigned char>(name[known.size()])))
            failUsage("depth encoding ", text, ": after ", known,
                      " comes a colon, then key=value with commas, as in '", known,
                      ":unknown=0,sky_beyond=500'");
    const std::string rest = colon == std::string::npos ? "" : text.substr(colon + 1);
    const json object = keyValues("encoding=" + name + "," + rest, "depth encoding " + text);
    try {
        return depthEncodingFromJson(object, "depth encoding " + text);
    } catch (const Error& e) {
        throw Error(ErrorKind::Usage, e.what());
    }
}

}  // namespace brume
