// #include "..." in effect files, with #line so that a compiler's message names the author's file and line.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>

#include "effect/effect.hpp"
#include "error.hpp"
#include "file_status.hpp"
#include "nearest_name.hpp"

namespace brume {

namespace fs = std::filesystem;

namespace {

constexpr size_t mostBytes = 8 << 20, deepest = 64;

struct Expander {
    const std::vector<std::string>& includePath;
    ExpandedSource result;
    std::vector<std::string> open;  // the chain of files being read, to find cycles
    std::vector<std::string> done;  // each file is included once

    int fileNumber(const std::string& path) {
        auto found = std::find(result.files.begin(), result.files.end(), path);
        if (found != result.files.end()) return int(found - result.files.begin());
        result.files.push_back(path);
        return int(result.files.size()) - 1;
    }

    void add(const std::string& path, const std::string& source, int firstLine) {
        if (result.text.size() + source.size() > mostBytes)
            failUsage(path, ": the shader with its includes is over 8 MiB");
        open.push_back(path);
        int number = fileNumber(path);
        int line = firstLine;
        result.text += text("#line ", line, " ", number, "\n");
        size_t begin = 0;
        static const std::regex directive(R"(^\s*#\s*include\s+"([^"]*)\"\s*(//.*)?$)");
        while (begin < source.size()) {
            size_t end = std::min(source.find('\n', begin), source.size());
            std::string one = source.substr(begin, end - begin);
            if (!one.empty() && one.back() == '\r') one.pop_back();
            std::smatch match;
            bool mayInclude = one.find("include") != std::string::npos && one.size() < 1000;
            if (mayInclude && std::regex_match(one, match, directive)) {
                include(match[1], path, line);
                result.text += text("#line ", line + 1, " ", number, "\n");
            } else {
                result.text += one + "\n";
            }
            begin = end + 1;
            line++;
        }
        open.pop_back();
    }

    void include(const std::string& name, const std::string& from, int line) {
        if (fs::path(name).is_absolute() || name.find("..") != std::string::npos)
            failUsage(from, ":", line, ": #include \"", name, "\" leaves the include path");
        std::string searched;
        for (const auto& folder : includePath) {
            std::string path = (fs::path(folder) / name).string();
            if (!isFile(path)) {
                searched += (searched.empty() ? "" : ", ") + folder;
                continue;
            }
            if (std::find(open.begin(), open.end(), path) != open.end())
                failUsage(from, ":", line, ": #include \"", name, "\" includes itself");
            if (std::find(done.begin(), done.end(), path) != done.end()) return;
            done.push_back(path);
            if (open.size() > deepest)
                failUsage(from, ":", line, ": #include \"", name, "\" is nested deeper than ", deepest,
                          " files");
            if (fs::file_size(path) > mostBytes) failUsage(path, ": an included file is over 8 MiB");
            std::ifstream in(path, std::ios::binary);
            add(path, std::string((std::istreambuf_iterator<char>(in)), {}), 1);
            return;
        }
        std::string near;
        for (const auto& folder : includePath)
            if (near.empty()) near = nearestBeside((fs::path(folder) / name).string());
        if (!near.empty())
            near = " (did you mean \"" + fs::path(name).replace_filename(near).string() + "\"?)";
        failUsage(from, ":", line, ": #include \"", name, "\" is not in ", searched, near);
    }
};

}  // namespace

ExpandedSource expandIncludes(const Effect& effect) {
    if (effect.source) return *effect.source;
    Expander expander{effect.includePath, {}, {}, {}};
    expander.add(effect.header.path, effect.header.body, effect.header.bodyLine);
    return std::move(expander.result);
}

}  // namespace brume
