#include "output_names.hpp"

#include <algorithm>
#include <filesystem>

#include "error.hpp"
#include "nearest_name.hpp"

namespace brume::host {
namespace {

namespace fs = std::filesystem;

const std::vector<std::string> formats = {"exr", "png", "jpg", "jpeg", "tif", "tiff", "npy"};

void requireFormat(const std::string& extension, const std::string& where) {
    std::string name = extension.substr(extension.starts_with("."));
    std::transform(name.begin(), name.end(), name.begin(), ::tolower);
    if (std::find(formats.begin(), formats.end(), name) == formats.end())
        failUsage(where, ": cannot write files ending in '", extension, "'", suggestion(name, formats));
}

std::string padded(size_t number, const std::string& width) {
    std::string digits = std::to_string(number);
    size_t count = width.empty() ? 1 : std::min<size_t>(std::stoul(width), 20);
    return digits.size() < count ? std::string(count - digits.size(), '0') + digits : digits;
}

/// What is filled in may be "..", and a folder that was there before may be a symbolic link.
void requireInside(const std::string& name, const std::string& folder) {
    // What is not there is canonical only from the root on.
    const fs::path root = fs::weakly_canonical(fs::absolute(folder)),
                   place = fs::weakly_canonical(fs::absolute(name).parent_path());
    if (std::mismatch(root.begin(), root.end(), place.begin(), place.end()).first != root.end())
        failUsage("-o: '", name, "' leads out of the folder '", folder, "', to '", place.string(), "'");
}

}  // namespace

std::string placeOf(const std::string& path) {
    const fs::path whole = fs::absolute(path).lexically_normal();
    std::error_code error;  // links in a circle lead nowhere
    const fs::path folder = fs::weakly_canonical(whole.parent_path(), error);
    return ((error ? whole.parent_path() : folder) / whole.filename()).string();
}

void requireNotRead(const std::string& output, const std::vector<std::string>& read) {
    const std::string place = placeOf(output);
    for (const std::string& file : read)
        if (placeOf(file) == place) failUsage("'", output, "' is an input; it would be overwritten");
}

Kept parseKept(const std::string& argument) {
    size_t dot = argument.rfind('.');
    if (dot == std::string::npos) return {argument};
    requireFormat(argument.substr(dot), "--keep " + argument);
    return {argument.substr(0, dot), argument.substr(dot)};
}

OutputNames::OutputNames(const std::string& out, const std::string& format, size_t frames)
    : out_(out), format_(format) {
    std::error_code none;
    if (!format.empty()) requireFormat(format, "--format");
    if (out.find('{') != std::string::npos)
        kind_ = Kind::Pattern;
    else if (fs::is_directory(out, none) || out.ends_with("/") || fs::path(out).extension().empty())
        kind_ = Kind::Folder;
    else
        kind_ = Kind::File;
    if (kind_ != Kind::Folder) {
        requireFormat(fs::path(out).extension().string(), "-o " + out);
        if (!format.empty()) failUsage("--format: only where -o is a folder; here its name says '", out, "'");
    }
    if (kind_ == Kind::File && frames > 1)
        failUsage("-o ", out, ": one file for ", frames, " frames; give a folder, or a name with {stem}");
}

std::string OutputNames::of(const std::string& input, size_t index, const Variant& variant,
                            const Settings& settings) const {
    fs::path source(input), out(out_);
    std::string suffix = variant.label.empty() ? "" : "_" + variant.label;
    if (kind_ == Kind::Folder) {
        std::string ending = format_.empty() ? (source.extension() == ".exr" ? "exr" : "png") : format_;
        return (out / (source.stem().string() + suffix + "." + ending)).string();
    }
    if (kind_ == Kind::File)
        return (out.parent_path() / (out.stem().string() + suffix + out.extension().string())).string();
    std::string name;
    for (size_t at = 0; at < out_.size();) {
        size_t open = out_.find('{', at), close = out_.find('}', open);
        name += out_.substr(at, open - at);
        if (open == std::string::npos) break;
        if (close == std::string::npos) failUsage("-o ", out_, ": '{' without '}'");
        std::string key = out_.substr(open + 1, close - open - 1), width;
        if (size_t colon = key.find(':'); colon != std::string::npos) {
            width = key.substr(colon + 1);
            key.resize(colon);
            if (width.find_first_not_of("0123456789") != std::string::npos || width.size() > 3)
                failUsage("-o ", out_, ": '{", key, ":", width, "}' should have a number of digits");
        }
        std::vector<std::string> known = {"stem", "index", "param"};
        const std::string* found = nullptr;
        for (const auto& [path, value] : settings) {
            std::string last = path.substr(path.rfind('.') + 1);
            if (key == path || key == last) found = &value;
            known.push_back(last);
        }
        if (key == "stem")
            name += source.stem().string();
        else if (key == "index")
            name += padded(index, width);
        else if (key == "param")
            name += variant.label;
        else if (found)
            for (char c : *found) name += c == '/' ? '_' : c;
        else
            failUsage("-o ", out_, ": nothing called '{", key, "}'", suggestion(key, known));
        at = close + 1;
    }
    requireInside(name, folder());
    return name;
}

std::string OutputNames::folder() const {
    fs::path folder =
        kind_ == Kind::Folder ? fs::path(out_) : fs::path(out_.substr(0, out_.find('{'))).parent_path();
    return folder.empty() ? "." : folder.string();
}

std::string OutputNames::keptBeside(const std::string& output, const Kept& kept) {
    fs::path path(output);
    return (path.parent_path() / (path.stem().string() + "." + kept.image + kept.extension)).string();
}

}  // namespace brume::host
