#include "frame/sequence.hpp"

#include <glob.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "error.hpp"
#include "file_status.hpp"
#include "frame/attributes.hpp"
#include "frame/image_file.hpp"
#include "frame/nearest_times.hpp"
#include "frame/pairing.hpp"
#include "frame/read.hpp"
#include "nearest_name.hpp"
#include "strict_json.hpp"

namespace brume {

namespace fs = std::filesystem;

namespace {

constexpr double mostApart = .02;  // s, as TUM's associate.py

std::optional<double> asNumber(const std::string& word) {
    char* end = nullptr;
    const double value = std::strtod(word.c_str(), &end);
    if (word.empty() || *end != 0 || !std::isfinite(value)) return std::nullopt;
    return value;
}

/// "1305031102.175304": digits with a fraction. "0012" is a frame's number, not a time.
std::optional<double> timestampOf(const std::string& path) {
    const std::string stem = stemOf(path);
    return stem.find('.') == std::string::npos ? std::nullopt : asNumber(stem);
}

/// The last run of digits in a stem.
std::optional<long> numberOf(const std::string& path) {
    const std::string stem = stemOf(path);
    const size_t last = stem.find_last_of("0123456789");
    if (last == std::string::npos) return std::nullopt;
    size_t first = last;
    while (first > 0 && std::isdigit(static_cast<unsigned char>(stem[first - 1]))) --first;
    if (last - first >= 18) return std::nullopt;
    return std::stol(stem.substr(first, last - first + 1));
}

/// Names in the order people count: frame9 before frame10.
bool countsBefore(const std::string& a, const std::string& b) {
    size_t i = 0, j = 0;
    while (i < a.size() && j < b.size()) {
        const bool digits =
            std::isdigit(static_cast<unsigned char>(a[i])) && std::isdigit(static_cast<unsigned char>(b[j]));
        if (!digits) {
            if (a[i] != b[j]) return a[i] < b[j];
            ++i, ++j;
            continue;
        }
        const auto run = [](const std::string& s, size_t& at) {
            const size_t start = s.find_first_not_of('0', at);
            at = std::min(s.find_first_not_of("0123456789", at), s.size());
            return start == std::string::npos || start >= at ? std::string() : s.substr(start, at - start);
        };
        const std::string x = run(a, i), y = run(b, j);
        if (x.size() != y.size()) return x.size() < y.size();
        if (x != y) return x < y;
    }
    return a.size() - i < b.size() - j;
}

struct Pattern {
    std::string before, after;
    size_t digits = 0;  ///< at least as many
};

std::optional<Pattern> patternIn(const std::string& name) {
    const size_t hash = name.find('#');
    if (hash != std::string::npos) {
        const size_t end = std::min(name.find_first_not_of('#', hash), name.size());
        return Pattern{name.substr(0, hash), name.substr(end), end - hash};
    }
    const size_t percent = name.find('%');
    if (percent == std::string::npos) return std::nullopt;
    size_t at = percent + 1;
    while (at < name.size() && std::isdigit(static_cast<unsigned char>(name[at]))) ++at;
    if (at >= name.size() || name[at] != 'd') return std::nullopt;
    const std::string width = name.substr(percent + 1, at - percent - 1);
    if (width.size() > 2) failUsage(name, ": a number of ", width, " digits fits no file name");
    return Pattern{name.substr(0, percent), name.substr(at + 1), width.empty() ? 1 : std::stoul(width)};
}

std::string filled(const Pattern& pattern, long number) {
    std::string digits = std::to_string(number);
    if (digits.size() < pattern.digits) digits.insert(0, pattern.digits - digits.size(), '0');
    return pattern.before + digits + pattern.after;
}

/// Existing files of a pattern by their numbers.
std::map<long, std::string> matching(const std::string& name) {
    const Pattern pattern = *patternIn(name);
    const fs::path folder = fs::path(pattern.before).parent_path();
    if (pattern.before.size() + 1 < folder.string().size() || pattern.after.find('/') != std::string::npos)
        failIo(name, ": the frame's number must stand in the file's name, not in a folder's");
    const std::string before = fs::path(pattern.before).filename().string();
    std::map<long, std::string> found;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder.empty() ? "." : folder, error)) {
        const std::string file = entry.path().filename().string();
        if (file.size() < before.size() + pattern.digits + pattern.after.size()) continue;
        if (!file.starts_with(before) || !file.ends_with(pattern.after)) continue;
        const std::string digits =
            file.substr(before.size(), file.size() - before.size() - pattern.after.size());
        if (digits.size() > 18 || digits.find_first_not_of("0123456789") != std::string::npos) continue;
        if (digits.size() > pattern.digits && digits[0] == '0') continue;
        found[std::stol(digits)] = (folder / file).string();
    }
    if (found.empty()) failIo(name, ": no file matches");
    return found;
}

/// What a folder's sidecars speak of: a light's map is no frame of its own. A sequence's sidecars share their
/// maps, so the first tells.
class SpokenOf {
  public:
    explicit SpokenOf(const fs::path& folder) {
        std::error_code error;
        fs::path first;
        for (const auto& entry : fs::directory_iterator(folder.empty() ? "." : folder, error))
            if (entry.path().extension() == ".json" && (first.empty() || entry.path() < first))
                first = entry.path();
        try {
            if (!first.empty()) sidecar_ = readText(first, 64);
        } catch (const Error&) {  // whoever reads its frame says why
        }
    }
    bool operator()(const fs::path& path) const {
        const fs::path owner = path.stem().stem();  // NAME.sun.exr beside NAME.json
        const bool isBeside = !path.stem().extension().empty() && !isDepthBeside(path.string()) &&
                              fs::exists(path.parent_path() / (owner.string() + ".json"));
        return (isBeside || sidecar_.find('"' + path.filename().string() + '"') != std::string::npos) &&
               !isThere(fs::path(path).replace_extension(".json"));
    }

  private:
    std::string sidecar_;
};

std::string depthStem(const std::string& path) {
    return path.ends_with(".depth" + fs::path(path).extension().string())
               ? fs::path(path).stem().stem().string()
               : stemOf(path);
}

/// What apply puts beside the pictures of a long run.
bool isContactSheet(const fs::path& path) {
    const std::string name = path.filename().string();
    return name == "contact_sheet.png" || (name.starts_with("contact_sheet_") && name.ends_with(".png"));
}

/// Whether an output's record says that apply kept this file beside it. What it keeps has that record, too,
/// where its format can hold one.
bool isNamedAsKept(const std::string& file, const std::string& output) {
    try {
        const auto attributes = readAttributes(output);
        const auto record = attributes.find(recordKey);
        if (record == attributes.end()) return false;
        const nlohmann::json kept = parseJson(record->second).value("kept", nlohmann::json::array());
        return std::find(kept.begin(), kept.end(), fs::path(file).filename().string()) != kept.end();
    } catch (const std::exception&) {  // whoever reads it says why
        return false;
    }
}

/// Of files among which its picture is, NAME.transmittance.exr is no frame. Depth is depth, whoever wrote it.
void leaveOutKept(std::vector<std::string>& files) {
    std::multimap<std::string, std::string> byName;  // without ending
    for (const std::string& file : files) byName.emplace(fs::path(file).replace_extension().string(), file);
    std::erase_if(files, [&](const std::string& file) {
        const fs::path name = fs::path(file).replace_extension();
        if (!name.has_extension() || isDepthBeside(file)) return false;
        const auto [first, last] = byName.equal_range(fs::path(name).replace_extension().string());
        return first != last && (isNamedAsKept(file, file) || std::any_of(first, last, [&](const auto& of) {
                                     return isNamedAsKept(file, of.second);
                                 }));
    });
}

std::vector<std::string> imagesIn(const std::string& folder, bool depths) {
    std::vector<std::string> images;
    std::error_code error;
    std::string inside;  // the first folder
    const SpokenOf isMap(folder);
    for (const auto& entry : fs::directory_iterator(folder, error)) {
        const fs::path& path = entry.path();
        if (entry.is_directory() && (inside.empty() || path.string() < inside)) inside = path.string();
        if (entry.is_regular_file() && isImageEnding(path.extension().string()) &&
            (depths || !isDepthBeside(path.string())) && !isMap(path) && !isContactSheet(path) &&
            path.filename().string()[0] != '.')
            images.push_back(path.string());
    }
    if (error) failIo(folder, ": ", error.message());
    if (images.empty())
        failIo(folder, ": the folder holds no images",
               inside.empty() ? "" : "; folders in it are not looked into: name one, such as " + inside);
    leaveOutKept(images);
    std::sort(images.begin(), images.end(), countsBefore);
    return images;
}

bool isGlob(const std::string& name) { return name.find_first_of("*?") != std::string::npos; }

std::vector<std::string> globbed(const std::string& name, bool depths) {
    glob_t found{};
    std::vector<std::string> files;
    if (glob(name.c_str(), 0, nullptr, &found) == 0)
        for (size_t k = 0; k < found.gl_pathc; ++k)
            if ((depths || !isDepthBeside(found.gl_pathv[k])) &&
                isImageEnding(fs::path(found.gl_pathv[k]).extension().string()))
                files.push_back(found.gl_pathv[k]);
    std::map<fs::path, SpokenOf> isMap;
    std::erase_if(files, [&](const std::string& file) {
        const fs::path folder = fs::path(file).parent_path();
        return isMap.try_emplace(folder, folder).first->second(file);
    });
    globfree(&found);
    leaveOutKept(files);
    if (files.empty()) failIo(name, ": no file matches");
    std::sort(files.begin(), files.end(), countsBefore);
    return files;
}

bool isList(const std::string& name) { return fs::path(name).extension() == ".txt"; }

std::vector<FrameFiles> readList(const std::string& name) {
    std::istringstream in(readText(name, 64));
    const fs::path folder = fs::path(name).parent_path();
    std::vector<FrameFiles> frames;
    int lineNumber = 0;
    for (std::string line; std::getline(in, line);) {
        ++lineNumber;
        std::istringstream words(line.substr(0, line.find('#')));
        std::vector<std::string> word;
        for (std::string w; words >> w;) word.push_back(w);
        if (word.empty()) continue;
        FrameFiles frame;
        size_t at = 0;
        if (word.size() > 1) frame.time = asNumber(word[0]);
        if (frame.time) ++at;
        frame.color = (folder / word[at++]).string();
        if (frame.time && at < word.size()) ++at;  // the depth's own time
        if (at < word.size()) frame.depth = (folder / word[at++]).string();
        if (at != word.size())
            failIo(name, ":", lineNumber,
                   ": is not \"color\", \"color depth\", \"time color\" or "
                   "\"time color time depth\"");
        frames.push_back(frame);
    }
    if (frames.empty()) failIo(name, ": the list is empty");
    return frames;
}

std::vector<FrameFiles> colorFiles(const std::string& name) {
    std::vector<FrameFiles> frames;
    if (name.empty()) failIo("the name of a frame is empty");
    if (isList(name)) return readList(name);
    if (isFolder(name))
        for (const std::string& file : imagesIn(name, false)) frames.push_back({file, "", timestampOf(file)});
    else if (isThere(name))
        frames.push_back({name, "", timestampOf(name)});
    else if (patternIn(name))
        for (const auto& [number, file] : matching(name)) frames.push_back({file, "", {}});
    else if (isGlob(name))
        for (const std::string& file : globbed(name, false)) frames.push_back({file, "", timestampOf(file)});
    else
        frames.push_back({name, "", {}});  // reading it says what is wrong
    return frames;
}

struct DepthFile {
    std::string path;
    std::optional<double> time;
};

std::vector<FrameFiles> pairByNearestTime(const std::vector<FrameFiles>& frames,
                                          const std::vector<DepthFile>& depths, const std::string& name) {
    std::vector<double> frameTimes, depthTimes;
    for (const FrameFiles& f : frames) frameTimes.push_back(*f.time);
    for (const DepthFile& d : depths) depthTimes.push_back(*d.time);
    const std::vector<int> depthOf = pairNearest(frameTimes, depthTimes, mostApart);
    std::vector<FrameFiles> paired;
    for (size_t f = 0; f < frames.size(); ++f) {
        if (depthOf[f] < 0) continue;
        paired.push_back(frames[f]);
        paired.back().depth = depths[depthOf[f]].path;
    }
    if (paired.empty()) failIo(name, ": no depth lies within .02 s of a frame");
    return paired;
}

/// By equal stem, else by time, else by number.
std::vector<FrameFiles> pairWith(std::vector<FrameFiles> frames, const std::vector<DepthFile>& depths,
                                 const std::string& name) {
    std::map<std::string, std::string> byStem, another;  // a second of that name, of another format
    std::map<long, std::string> byNumber;
    for (const DepthFile& d : depths) {
        const std::string& first = byStem.try_emplace(depthStem(d.path), d.path).first->second;
        if (first != d.path) another.try_emplace(depthStem(d.path), d.path);
        if (const auto number = numberOf(d.path)) byNumber[*number] = d.path;
    }
    const auto allHave = [&](auto&& depthOf) {
        return std::all_of(frames.begin(), frames.end(),
                           [&](const FrameFiles& f) { return !depthOf(f).empty(); });
    };
    const auto stemDepth = [&](const FrameFiles& f) {
        const auto found = byStem.find(stemOf(f.color));
        return found == byStem.end() ? std::string() : found->second;
    };
    const auto numberDepth = [&](const FrameFiles& f) {
        const auto number = numberOf(f.color);
        const auto found = number ? byNumber.find(*number) : byNumber.end();
        return found == byNumber.end() ? std::string() : found->second;
    };
    const bool timed =
        std::all_of(frames.begin(), frames.end(), [](const FrameFiles& f) { return bool(f.time); }) &&
        std::all_of(depths.begin(), depths.end(), [](const DepthFile& d) { return bool(d.time); });
    const auto takeStemDepth = [&](FrameFiles& f) {
        f.depth = stemDepth(f);
        if (const auto other = another.find(stemOf(f.color)); other != another.end())
            f.missing = ambiguity(f.color, f.depth, other->second);
    };
    if (allHave(stemDepth)) {
        std::for_each(frames.begin(), frames.end(), takeStemDepth);
        return frames;
    }
    if (timed) return pairByNearestTime(frames, depths, name);
    // left_0001 and right_0001 are two views: a depth of that number belongs to one of them at most.
    std::set<long> numbers;
    size_t numbered = 0;
    for (const FrameFiles& f : frames)
        if (const auto number = numberOf(f.color)) numbered++, numbers.insert(*number);
    const bool numbersDiffer = byNumber.size() == depths.size() && numbers.size() == numbered;
    if (numbersDiffer && allHave(numberDepth)) {
        for (FrameFiles& f : frames) f.depth = numberDepth(f);
        return frames;
    }
    // Some are missing: the way that serves the most frames tells which.
    const auto served = [&](auto&& depthOf) {
        return std::count_if(frames.begin(), frames.end(),
                             [&](const FrameFiles& f) { return !depthOf(f).empty(); });
    };
    const bool byNumbers = numbersDiffer && served(numberDepth) > served(stemDepth);
    for (FrameFiles& f : frames) {
        if (byNumbers)
            f.depth = numberDepth(f);
        else
            takeStemDepth(f);
        if (f.depth.empty())
            f.missing = text(f.color, ": ", name, " holds no depth of the same name, number or time");
    }
    return frames;
}

std::vector<FrameFiles> withDepth(const std::vector<FrameFiles>& frames, const std::string& depth) {
    std::vector<FrameFiles> paired = frames;
    if (depth == noDepth) {
        for (FrameFiles& f : paired) f.depth = depth;
        return paired;
    }
    if (depth.find("{stem}") != std::string::npos) {
        for (FrameFiles& f : paired) try {
                f.depth = depthFileFor(f.color, depth);
            } catch (const Error& e) {
                f.missing = e.what();
            }
        const bool noneFits =
            std::all_of(paired.begin(), paired.end(), [](const FrameFiles& f) { return !f.missing.empty(); });
        for (FrameFiles& f : paired)
            if (noneFits && frames.size() > 1)
                f.missing += "; if names differ, give --depth the folder: it pairs by time or number as well";
        return paired;
    }
    const bool isPattern = !isThere(depth) && patternIn(depth), isAny = !isThere(depth) && isGlob(depth);
    if (isList(depth) || isFolder(depth) || (isAny && !isPattern)) {
        std::vector<DepthFile> depths;
        if (isList(depth))
            for (const FrameFiles& d : readList(depth)) depths.push_back({d.color, d.time});
        else
            for (const std::string& file : isAny ? globbed(depth, true) : imagesIn(depth, true))
                depths.push_back({file, timestampOf(file)});
        std::set<fs::path> pictures;
        for (const FrameFiles& f : frames) pictures.insert(fs::weakly_canonical(f.color));
        std::erase_if(depths,
                      [&](const DepthFile& d) { return pictures.count(fs::weakly_canonical(d.path)) > 0; });
        if (depths.empty())
            failIo(depth,
                   ": holds no depth but the pictures themselves; without --depth it is looked for in "
                   "them (EXR) and beside them, as NAME.depth.EXT");
        return pairWith(paired, depths, depth);
    }
    if (isPattern) {
        const std::map<long, std::string> files = matching(depth);
        for (FrameFiles& f : paired) {
            const std::optional<long> number = numberOf(f.color);
            const auto found = number ? files.find(*number) : files.end();
            if (found != files.end())
                f.depth = found->second;
            else
                f.missing =
                    text(f.color, ": has no depth ", number ? filled(*patternIn(depth), *number) : depth);
        }
        return paired;
    }
    if (frames.size() > 1 && !isThere(depth)) {
        if (const size_t brace = depth.find('{'); brace != std::string::npos)
            failIo(depth, ": the name of a frame is written {stem}, as in 'depth/{stem}.png'");
        failIo(depth, ": there is no such depth file, folder, pattern or list", suggestionBeside(depth));
    }
    if (frames.size() > 1)
        failIo(depth, ": one depth file for ", frames.size(),
               " frames; name a pattern such as 'depth/{stem}.png', or a folder");
    paired.front().depth = depth;
    return paired;
}

}  // namespace

std::vector<FrameFiles> expandFrames(const std::vector<std::string>& names, const std::string& depth) {
    std::vector<FrameFiles> frames;
    for (const std::string& name : names)
        for (const FrameFiles& frame : colorFiles(name)) frames.push_back(frame);
    if (!depth.empty()) frames = withDepth(frames, depth);
    if (std::all_of(frames.begin(), frames.end(), [](const FrameFiles& f) { return !f.missing.empty(); }) &&
        !frames.empty())
        failIo(frames.front().missing);
    if (!frames.empty() && frames.front().time) {
        const double first = *frames.front().time;
        for (FrameFiles& f : frames)
            if (f.time) *f.time -= first;
    }
    return frames;
}

FramePair readFrame(const FrameFiles& files, int index, const ReadOptions& options) {
    if (!files.missing.empty()) failIo(files.missing);
    ReadOptions withFiles = options;
    if (!files.depth.empty()) withFiles.depth = files.depth;
    FramePair frame = readFrame(files.color, withFiles);
    frame.index = index;
    if (files.time) frame.time = *files.time;
    return frame;
}

}  // namespace brume
