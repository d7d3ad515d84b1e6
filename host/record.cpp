#include "record.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "effect/effect.hpp"
#include "error.hpp"
#include "strict_json.hpp"

namespace brume::host {
namespace {

namespace fs = std::filesystem;
using json = nlohmann::ordered_json;

// Tells changed contents apart; not meant against malice.
class ContentHash {
  public:
    void add(const char* data, size_t count) {
        for (size_t k = 0; k < count; k += 8) {
            uint64_t word = 0;
            std::memcpy(&word, data + k, std::min<size_t>(8, count - k));
            h_ = std::rotl(h_ ^ word, 29) * 0xbf58476d1ce4e5b9u;
        }
        h_ ^= count;
    }
    void addFile(const std::string& path) {
        std::ifstream in(path, std::ios::binary);
        if (!in) failIo("'", path, "' cannot be read");
        std::vector<char> block(1 << 18);
        while (in) {
            in.read(block.data(), std::streamsize(block.size()));
            add(block.data(), size_t(in.gcount()));
        }
    }
    std::string digits() const {
        char digits[17];
        std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(h_ ^ h_ >> 31));
        return digits;
    }

  private:
    uint64_t h_ = 0x9e3779b97f4a7c15u;
};

std::string contentHash(const std::string& path) {
    ContentHash hash;
    hash.addFile(path);
    return hash.digits();
}

/// A file's name may be no UTF-8, which JSON must be: then it is its bytes' numbers.
json nameAsJson(const std::string& name) {
    try {
        json(name).dump();
        return name;
    } catch (const json::exception&) {
        return std::vector<uint8_t>(name.begin(), name.end());
    }
}

std::string nameOf(const json& name) {
    if (!name.is_array()) return name.get<std::string>();
    const auto bytes = name.get<std::vector<uint8_t>>();
    return {bytes.begin(), bytes.end()};
}

std::string shown(const json& value) { return value.dump(-1, ' ', false, json::error_handler_t::replace); }

// A folder of outputs may be moved.
std::string nameInFolder(const std::string& path) { return fs::path(path).filename().string(); }

int64_t changeTime(const std::string& path) {
    return std::chrono::duration_cast<std::chrono::milliseconds>(fs::last_write_time(path).time_since_epoch())
        .count();
}

json identityOf(const Making& making) {
    json made;
    made["version"] = BRUME_VERSION;
    made["input"] = nameAsJson(making.input);
    json frame = json::object();
    if (!making.frame.depth.empty()) frame["depth"] = nameAsJson(making.frame.depth);
    if (!making.frame.encoding.empty()) frame["encoding"] = making.frame.encoding;
    if (!making.frame.camera.empty()) frame["camera"] = making.frame.camera;
    if (!making.frame.color.empty()) frame["color"] = making.frame.color;
    made["frame"] = frame;
    made["index"] = making.index;
    if (making.time) made["time"] = *making.time;
    made["fps"] = making.framesPerSecond;
    made["seed"] = making.seed;
    made["backend"] = making.backend;
    made["with_depth"] = making.withDepth;
    made["preset"] = json::parse(*making.preset);
    made["effects"] = json::parse(*making.effects);
    return made;
}

}  // namespace

json effectFiles(const Chain& chain) {
    json hashes = json::object();
    for (const Step& step : chain.steps) {
        const Effect& effect = *step.effect;
        if (hashes.contains(effect.name())) continue;
        ContentHash hash;
        for (const std::string& file : expandIncludes(effect).files) hash.addFile(file);
        const std::string library = fs::path(effect.header.path).replace_extension(".so").string();
        if (effect.plugin) hash.addFile(library);
        hashes[effect.name()] = hash.digits();
    }
    return hashes;
}

json describeFiles(const std::vector<std::string>& files) {
    json list = json::array();
    for (const std::string& file : files) {
        std::error_code error;
        auto bytes = fs::file_size(file, error);
        if (error) failIo("'", file, "' vanished while it was worked on");
        list.push_back({{"name", nameAsJson(file)},
                        {"bytes", bytes},
                        {"changed", changeTime(file)},
                        {"hash", contentHash(file)}});
    }
    return list;
}

std::string writeRecord(const Making& making, const json& files, const std::vector<std::string>& kept) {
    json record = identityOf(making);
    record["files"] = files;
    for (const std::string& name : kept) record["kept"].push_back(nameAsJson(nameInFolder(name)));
    json settings = json::object();
    for (const auto& [path, value] : making.settings) settings[path] = value;
    record["settings"] = settings;
    return shown(record);
}

bool wasKeptBeside(const json& record, const std::string& kept) {
    const json names = record.value("kept", json::array());
    return std::find(names.begin(), names.end(), nameAsJson(nameInFolder(kept))) != names.end();
}

std::optional<json> readRecord(const std::string& path) {
    auto attributes = readAttributes(path);
    auto found = attributes.find(recordKey);
    if (found == attributes.end()) return {};
    try {
        if (parseJson(found->second).is_object()) return json::parse(found->second);  // in its own order
    } catch (const Error&) {
    } catch (const json::exception&) {
    }
    return {};  // not of our making
}

Making makingOf(const json& record, const std::string& path) {
    try {
        Making making;
        record.at("version").get<std::string>();
        making.input = nameOf(record.at("input"));
        const json& frame = record.at("frame");
        if (frame.contains("depth")) making.frame.depth = nameOf(frame["depth"]);
        making.frame.encoding = frame.value("encoding", "");
        making.frame.camera = frame.value("camera", "");
        making.frame.color = frame.value("color", "");
        making.index = record.at("index").get<size_t>();
        if (record.contains("time")) making.time = record["time"].get<double>();
        making.framesPerSecond = record.at("fps").get<double>();
        making.seed = record.at("seed").get<uint32_t>();
        making.backend = record.at("backend").get<std::string>();
        making.withDepth = record.at("with_depth").get<bool>();
        making.preset = std::make_shared<std::string>(record.at("preset").dump());
        making.effects = std::make_shared<std::string>(record.value("effects", json::object()).dump());
        if (record.contains("settings"))
            for (const auto& [key, value] : record["settings"].items())
                making.settings.emplace_back(key, value.get<std::string>());
        const json &index = record["index"], &seed = record["seed"];
        const double fps = making.framesPerSecond;
        if (!index.is_number_unsigned() || making.index > 1u << 31 || !seed.is_number_unsigned() ||
            seed.get<uint64_t>() != making.seed || !(fps >= 1e-6 && fps <= 1e6))
            failIo("'", path,
                   "': its record of how it was made is damaged: index, seed or fps is out of range");
        return making;
    } catch (const json::exception& e) {
        failIo("'", path, "': its record of how it was made is damaged: ", reasonOf(e));
    }
}

std::string staleness(const json& record, const Making& making) {
    json expected = identityOf(making);
    for (const auto& [key, value] : expected.items())
        if (!record.contains(key) || record[key] != value) {
            std::string was = record.contains(key) ? shown(record[key]) : "nothing";
            return key == "preset"    ? "was made with another preset"
                   : key == "effects" ? "was made before an effect of it changed"
                                      : text("was made with ", key, " ", was, ", not ", shown(value));
        }
    const std::string sidecar = fs::path(making.input).replace_extension(".json").string();
    bool hasSidecar = false;
    try {
        for (const json& file : record.at("files")) {
            const std::string name = nameOf(file.at("name"));
            hasSidecar |= name == sidecar;
            std::error_code error;
            auto bytes = fs::file_size(name, error);
            if (error) return text("was made from '", name, "', which is gone");
            bool looksSame = bytes == file.value("bytes", uintmax_t(0));
            if (!looksSame || (changeTime(name) != file.value("changed", int64_t(0)) &&
                               contentHash(name) != file.value("hash", "")))
                return text("was made before '", name, "' changed");
        }
    } catch (const json::exception&) {
        return "has a damaged record of what it was made from";
    }
    std::error_code none;
    if (!hasSidecar && fs::exists(sidecar, none)) return text("was made before '", sidecar, "' was there");
    return "";
}

}  // namespace brume::host
