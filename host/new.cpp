// brume new: an effect of one's own, from the sample plugin.
#include <filesystem>
#include <fstream>
#include <iostream>
#include <regex>

#include "commands.hpp"
#include "effect/effect.hpp"
#include "error.hpp"
#include "file_status.hpp"
#include "install_root.hpp"

namespace brume::host {
namespace {

namespace fs = std::filesystem;

// The three spellings of the sample's name, as they occur in it.
const std::string sampleName = "distance_veil", sampleTitle = "Distance veil", sampleType = "DistanceVeil";

void checkName(const std::string& name) {
    static const std::regex allowed("[a-z][a-z0-9]*(_[a-z0-9]+)*");
    if (name.size() > 64 || !std::regex_match(name, allowed))
        failUsage("'", name,
                  "' cannot name an effect: use small letters, digits and single underscores, such as "
                  "morning_mist, at most 64 in all");
    const auto names = EffectRegistry::standard().names();
    if (std::find(names.begin(), names.end(), name) != names.end())
        failUsage("there is an effect '", name, "' already; choose another name");
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    for (size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
        text.replace(at, from.size(), to);
    return text;
}

// "morning_mist" reads "Morning mist".
std::string titleOf(const std::string& name) {
    std::string title = replaced(name, "_", " ");
    title[0] = char(std::toupper(static_cast<unsigned char>(title[0])));
    return title;
}

// "morning_mist" becomes MorningMist.
std::string typeOf(const std::string& name) {
    std::string type;
    bool isStart = true;
    for (char c : name) {
        if (c != '_') type += isStart ? char(std::toupper(static_cast<unsigned char>(c))) : c;
        isStart = c == '_';
    }
    return type;
}

void writeEffect(const std::string& name) {
    checkName(name);
    if (isThere(name)) failUsage("'", name, "' exists already; nothing was written");
    const fs::path sample = fs::path(installRoot()) / "template";
    if (!isFolder(sample)) failIo(sample.string(), ": the sample plugin is not there; reinstall brume");
    std::error_code failed;
    fs::create_directory(name, failed);
    if (failed) failIo("'", name, "' cannot be made: ", failed.message());
    std::cout << "Wrote";
    std::vector<fs::path> files;
    for (const auto& item : fs::directory_iterator(sample))
        if (item.is_regular_file()) files.push_back(item.path());
    std::sort(files.begin(), files.end());
    for (const fs::path& file : files) {
        std::ifstream in(file, std::ios::binary);
        const std::string content((std::istreambuf_iterator<char>(in)), {});
        const fs::path target = fs::path(name) / replaced(file.filename().string(), sampleName, name);
        std::ofstream out(target, std::ios::binary);
        out << replaced(replaced(replaced(content, sampleName, name), sampleTitle, titleOf(name)), sampleType,
                        typeOf(name));
        out.close();
        if (!in || !out) failIo(target.string(), ": cannot be written");
        std::cout << (file == files[0] ? " " : ", ") << target.string();
    }
    const fs::path prefix = fs::path(installRoot()).parent_path().parent_path();
    const bool isInstalled = isFolder(prefix / "lib/cmake/brume");
    std::cout << "\n\n";
    if (!isInstalled)
        std::cout << "This brume is not installed: run cmake --install on its build first, and tell cmake\n"
                     "-DCMAKE_PREFIX_PATH= where.\n\n";
    std::cout << "Next:\n  cd " << name << "\n  cmake -B build"
              << (isInstalled ? " -DCMAKE_PREFIX_PATH=" + prefix.string() : "") << " && cmake --build build\n"
              << "  ctest --test-dir build\n  brume check build/effects/" << name << "\n"
              << "  BRUME_EFFECT_PATH=build/effects brume apply " << name << ".json FRAME -o " << name
              << ".png\n";
    if (const fs::path guide = prefix / "share/doc/brume/AUTHORING.md"; isThere(guide))
        std::cout << "\nFrom there to an effect of your own: " << guide.string() << "\n";
}

}  // namespace

void addNew(CLI::App& program) {
    auto name = std::make_shared<std::string>();
    CLI::App* command =
        program.add_subcommand("new", "A new effect of your own: sources that build and pass check");
    command->add_option("NAME", *name, "Its name, and its folder's: small letters, digits, underscores")
        ->required();
    command->footer(
        "Writes the folder NAME with the shader (NAME.fs), the C++ half and its fp64 reference (NAME.cpp), a "
        "test\n"
        "(NAME_test.cpp), a preset (NAME.json) and a CMakeLists.txt. It is a veil of light that grows with "
        "distance:\n"
        "a working effect to change into your own.\n"
        "\nExample:\n  brume new morning_mist");
    command->callback([name] { writeEffect(*name); });
}

}  // namespace brume::host
