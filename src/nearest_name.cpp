#include "nearest_name.hpp"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <system_error>

namespace brume {

namespace fs = std::filesystem;

static std::string lower(std::string word) {
    for (char& c : word) c = char(std::tolower((unsigned char)c));
    return word;
}

// Letters added, left out, replaced, or swapped with their neighbour.
static size_t editDistance(const std::string& a, const std::string& b) {
    std::vector<size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
    for (size_t j = 0; j <= b.size(); j++) row[j] = j;
    for (size_t i = 1; i <= a.size(); i++) {
        before.swap(last);
        last.swap(row);
        row[0] = i;
        for (size_t j = 1; j <= b.size(); j++) {
            row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] != b[j - 1])});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                row[j] = std::min(row[j], before[j - 2] + 1);
        }
    }
    return row[b.size()];
}

std::string nearestName(const std::string& wrong, const std::vector<std::string>& candidates) {
    if (wrong.size() > 200) return {};
    std::string best;
    size_t bestDistance = std::string::npos;
    for (const auto& candidate : candidates) {
        size_t distance = editDistance(lower(wrong), lower(candidate));
        bool isPart = wrong.size() >= 3 && lower(candidate).find(lower(wrong)) != std::string::npos;
        if (isPart) distance = std::min(distance, wrong.size() / 3);
        if (distance < bestDistance) bestDistance = distance, best = candidate;
    }
    return bestDistance <= std::max<size_t>(1, std::max(wrong.size(), best.size()) / 3) ? best
                                                                                        : std::string();
}

std::string suggestion(const std::string& wrong, const std::vector<std::string>& candidates) {
    if (candidates.empty()) return {};
    std::string near = nearestName(wrong, candidates);
    if (!near.empty()) return " (did you mean '" + near + "'?)";
    std::string list;
    for (const auto& candidate : candidates) list += (list.empty() ? "" : ", ") + candidate;
    return " (there are: " + list + ")";
}

static fs::path withoutSlash(const std::string& path) {
    return path.ends_with('/') ? fs::path(path).parent_path() : fs::path(path);
}

std::string nearestBeside(const std::string& missing) {
    constexpr size_t most = 4096;
    const fs::path path = withoutSlash(missing);
    std::vector<std::string> names;
    std::error_code error;
    fs::directory_iterator item(path.has_parent_path() ? path.parent_path() : fs::path("."), error);
    for (; !error && item != fs::directory_iterator() && names.size() < most; item.increment(error))
        names.push_back(item->path().filename().string());
    return nearestName(path.filename().string(), names);
}

std::string suggestionBeside(const std::string& missing) {
    const std::string near = nearestBeside(missing);
    return near.empty() ? ""
                        : " (did you mean '" + withoutSlash(missing).replace_filename(near).string() + "'?)";
}

}  // namespace brume
