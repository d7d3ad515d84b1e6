// brume as another project finds it: installed, moved, and a plugin built against it with nothing of the
// source tree.
#include <filesystem>
#include <regex>

#include "authoring/installed.hpp"

using testing::HasSubstr;
namespace fs = std::filesystem;

namespace brume::test {
namespace {

TEST_F(Installed, AllOfItIsThereAsFilesOfItsOwn) {
    for (const char* file : {"bin/brume", "lib/libbrume.so", "lib/brume/effects/depth_fog/depth_fog.so",
                             "lib/brume/effects/depth_fog/depth_fog.fs", "lib/brume/glsl/kit/image.glsl",
                             "lib/brume/glsl/common/noise.glsl", "include/brume/common/noise.hpp",
                             "include/brume/effect/plugin.hpp", "include/brume/effect/kit/math.hpp",
                             "lib/brume/presets/visibility_200.json", "lib/cmake/brume/brumeConfig.cmake",
                             "share/doc/brume/AUTHORING.md"})
        EXPECT_TRUE(fs::is_regular_file(prefix() / file)) << file;
    for (const auto& item : fs::recursive_directory_iterator(prefix()))
        EXPECT_FALSE(item.is_symlink()) << item.path();
    // Neither the fixtures of tests nor a path of the tree they were built in.
    EXPECT_FALSE(fs::exists(prefix() / "lib/brume/effects/throws"));
    auto paths = run(folder_, "! grep -rlF -e '" BRUME_SOURCE_DIR "' '" + prefix().string() + "'");
    EXPECT_EQ(paths.status, 0) << paths.out;
}

TEST_F(Installed, ItRunsWhereverItIsMovedTo) {
    addFrame("frame.exr");
    const fs::path moved = path("moved here");
    fs::copy(prefix(), moved, fs::copy_options::recursive);
    auto ran =
        run(folder_, "'" + moved.string() + "/bin/brume' apply visibility_200 frame.exr -o out.png && '" +
                         moved.string() + "/bin/brume' list");
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_TRUE(fs::exists(path("out.png")));
    EXPECT_THAT(ran.out, HasSubstr(moved.string() + "/lib/brume/effects"));
    EXPECT_THAT(ran.out, testing::Not(HasSubstr("Refused")));
}

TEST_F(Installed, APluginIsBuiltAgainstItAlone) {
    fs::copy(BRUME_SOURCE_DIR "/samples/plugin", path("plugin"));
    addFrame("frame.exr");
    auto built = installed(
        "cmake -G Ninja -S plugin -B build -DCMAKE_EXPORT_COMPILE_COMMANDS=ON && "
        "cmake --build build && ctest --test-dir build --output-on-failure");
    ASSERT_EQ(built.status, 0) << built.out << built.err;
    EXPECT_THAT(built.out, HasSubstr("100% tests passed"));
    const std::string commands = bytesOf(path("build/compile_commands.json"));
    EXPECT_THAT(commands, HasSubstr(prefix().string() + "/include/brume"));
    EXPECT_THAT(commands, testing::Not(HasSubstr(BRUME_SOURCE_DIR)));
    // What the compiler really opened.
    auto opened = run(folder_, "ninja -C build -t deps");
    EXPECT_THAT(opened.out, HasSubstr("effect/plugin.hpp"));
    EXPECT_THAT(opened.out, testing::Not(HasSubstr(BRUME_SOURCE_DIR)));

    auto applied = installed(
        "BRUME_EFFECT_PATH=build/effects brume apply plugin/distance_veil.json frame.exr -o a.png && "
        "brume apply build/effects/distance_veil frame.exr -o b.png");
    EXPECT_EQ(applied.status, 0) << applied.err;
    EXPECT_TRUE(fs::exists(path("a.png")) && fs::exists(path("b.png")));

    // Shipped: a user's own prefix.
    auto shipped = installed(
        "cmake --install build --prefix home/.local && cd home && "
        "XDG_DATA_HOME=$PWD/.local/share brume check distance_veil --random 1");
    EXPECT_EQ(shipped.status, 0) << shipped.out << shipped.err;
    EXPECT_THAT(shipped.out, testing::ContainsRegex("distance_veil .* ok\n"));
}

TEST_F(Installed, WhatNewWritesBuildsAndPassesAsItStands) {
    addFrame("frame.exr");
    auto ran = installed("brume new morning_mist");
    ASSERT_EQ(ran.status, 0) << ran.err;
    EXPECT_THAT(ran.out, HasSubstr("-DCMAKE_PREFIX_PATH=" + prefix().string()));
    EXPECT_THAT(ran.out, HasSubstr(prefix().string() + "/share/doc/brume/AUTHORING.md"));
    std::set<std::string> wanted = {"frame.exr"};
    for (const char* file : {"CMakeLists.txt", "morning_mist.cpp", "morning_mist.fs", "morning_mist.json",
                             "morning_mist_test.cpp"})
        wanted.insert(std::string("morning_mist/") + file);
    EXPECT_EQ(files(), wanted);
    EXPECT_EQ(run(folder_, "! grep -ri 'distance.\\?veil' morning_mist").status, 0)
        << "no trace of the sample's name";
    // As it says, but for the generator.
    auto built = installed(
        "cd morning_mist && cmake -G Ninja -B build && cmake --build build && "
        "ctest --test-dir build --output-on-failure && brume check build/effects/morning_mist && "
        "BRUME_EFFECT_PATH=build/effects brume apply morning_mist.json ../frame.exr -o ../mist.png");
    EXPECT_EQ(built.status, 0) << built.out << built.err;
    EXPECT_THAT(built.out, HasSubstr("100% tests passed"));
    EXPECT_THAT(built.out, testing::ContainsRegex("morning_mist .* ok\n"));
    EXPECT_TRUE(fs::exists(path("mist.png")));
}

TEST_F(Installed, NewRefusesWhatItShould) {
    fs::create_directory(path("taken"));
    for (const char* name :
         {"Mist", "1st", "morning-mist", "_mist", "mist_", "a__b", "../mist", "mist.fs", "''"})
        expectError(std::string("new ") + name, 2, "cannot name an effect");
    expectError("new depth_fog", 2, "there is an effect 'depth_fog' already");
    expectError("new taken", 2, "'taken' exists already");
    expectError("new", 2, "NAME");
    expectError("new " + std::string(65, 'a'), 2, "cannot name an effect");
}

}  // namespace
}  // namespace brume::test
