#include "reshade_preset.hpp"

#include <algorithm>
#include <sstream>
#include <unordered_map>

#include "error.hpp"
#include "frame/image_file.hpp"

namespace brume::host {
namespace {

std::string trimmed(const std::string& text) {
    const char* blanks = " \t\r\n";
    const size_t start = text.find_first_not_of(blanks);
    return start == std::string::npos ? "" : text.substr(start, text.find_last_not_of(blanks) - start + 1);
}

bool isComment(const std::string& line) {
    return line.empty() || line[0] == ';' || line[0] == '#' || line.rfind("//", 0) == 0;
}

// At single commas; two are one that is meant.
std::vector<std::string> listOf(const std::string& text) {
    std::vector<std::string> items(1);
    for (size_t k = 0; k < text.size(); k++) {
        if (text[k] != ',')
            items.back() += text[k];
        else if (k + 1 < text.size() && text[k + 1] == ',')
            items.back() += text[k++];
        else
            items.emplace_back();
    }
    std::vector<std::string> result;
    for (const std::string& item : items)
        if (!trimmed(item).empty()) result.push_back(trimmed(item));
    return result;
}

void readDefinitions(const std::string& text, std::map<std::string, std::string>& definitions) {
    for (const std::string& item : listOf(text)) {
        const size_t equals = item.find('=');
        definitions[trimmed(item.substr(0, equals))] =
            equals == std::string::npos ? "1" : trimmed(item.substr(equals + 1));
    }
}

std::vector<std::string> sorted(std::vector<std::string> on, const std::vector<std::string>& order) {
    std::unordered_map<std::string, size_t> ranks;
    for (const std::string& name : order) ranks.emplace(name, ranks.size());
    const auto rank = [&](const std::string& name) {
        const auto found = ranks.find(name);
        return found == ranks.end() ? ranks.size() : found->second;
    };
    std::stable_sort(on.begin(), on.end(),
                     [&](const std::string& a, const std::string& b) { return rank(a) < rank(b); });
    return on;
}

}  // namespace

ReshadePreset readReshadePreset(const std::string& path) {
    std::istringstream in(readText(path, 4));
    ReshadePreset preset;
    preset.path = path;
    auto* section = &preset.global;
    int number = 0;
    for (std::string line; std::getline(in, line);) {
        if (++number == 1 && line.rfind("\xEF\xBB\xBF", 0) == 0) line.erase(0, 3);
        line = trimmed(line);
        if (isComment(line)) continue;
        if (line[0] == '[') {
            section = &preset.sections[trimmed(line.substr(1, line.find(']') - 1))];
            continue;
        }
        const size_t equals = line.find('=');
        const std::string key = trimmed(line.substr(0, equals));
        (*section)[key] = {equals == std::string::npos ? "" : trimmed(line.substr(equals + 1)), number};
    }
    if (!preset.global.count("Techniques"))
        failUsage(path,
                  ": no line 'Techniques=' above the first [section] says which effects are on, as in "
                  "'Techniques=SpiritFog@SpiritFog.fx'; without one it is no ReShade preset");
    for (const auto& name :
         sorted(listOf(preset.global["Techniques"].text), listOf(preset.global["TechniqueSorting"].text))) {
        const size_t at = name.find('@');
        preset.techniques.emplace_back(name.substr(0, at),
                                       at == std::string::npos ? "" : name.substr(at + 1));
    }
    readDefinitions(preset.global["PreprocessorDefinitions"].text, preset.definitions);
    for (const auto& [name, values] : preset.sections)
        if (auto found = values.find("PreprocessorDefinitions"); found != values.end())
            readDefinitions(found->second.text, preset.definitions);
    for (const char* read : {"Techniques", "TechniqueSorting", "PreprocessorDefinitions"})
        preset.global.erase(read);
    return preset;
}

}  // namespace brume::host
