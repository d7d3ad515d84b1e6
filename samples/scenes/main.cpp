// brume_scenes: renders the sample scenes off screen and writes captured pairs.
#include <CLI/CLI.hpp>
#include <chrono>
#include <iostream>

#include "error.hpp"
#include "gl/context.hpp"
#include "renderer.hpp"
#include "write_pair.hpp"

namespace {

cv::Size parseSize(const std::string& text) {
    int width = 0, height = 0, read = 0;
    const int parts = std::sscanf(text.c_str(), "%dx%d%n", &width, &height, &read);
    if (parts != 2 || size_t(read) != text.size() || width < 1 || height < 1 || width > 16384 ||
        height > 16384)
        brume::failUsage("--size: \"", text,
                         "\" is not WIDTHxHEIGHT with sides of 1 to 16384, such as 1280x720");
    return {width, height};
}

void renderScene(const std::string& name, cv::Size size, int frames, const std::string& folder) {
    const auto start = std::chrono::steady_clock::now();
    const scenes::Scene scene = scenes::makeScene(name);
    const auto context = brume::GlContext::create(brume::GlPlatform::Auto);
    scenes::Renderer renderer(*context, scene);
    scenes::PairWriter writer(folder, scene, renderer.shadowMap(), frames);
    for (int k = 0; k < frames; k++) {
        const double place = frames > 1 ? double(k) / (frames - 1) : 0;
        const scenes::Capture capture = renderer.capture(scenes::cameraAt(scene, size, place), size);
        std::cout << writer.write(capture, k) << '\n';
    }
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    std::cerr << name << ": " << frames << (frames == 1 ? " frame" : " frames") << " of " << size.width << "×"
              << size.height << " in " << std::round(taken.count() * 10) / 10 << " s on "
              << context->describe() << '\n';
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app{
        "Renders sample scenes off screen as a game would, and writes what a capture of it holds: linear HDR "
        "colour, device depth, camera, lights, the sun's depth map."};
    std::string scene = "all", size = "1280x720", folder = ".";
    int frames = 1;
    app.add_option("--scene", scene, "forest_day, street_night, valley, or all")->capture_default_str();
    app.add_option("--size", size, "WIDTHxHEIGHT")->capture_default_str();
    app.add_option("--frames", frames, "pictures along the camera's path, NAME_0000 and on")
        ->check(CLI::Range(1, 100000))
        ->capture_default_str();
    app.add_option("-o,--output", folder, "folder, made if missing")->capture_default_str();
    try {
        app.parse(argc, argv);
        for (const std::string& name : scene == "all" ? scenes::sceneNames() : std::vector{scene})
            renderScene(name, parseSize(size), frames, folder);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    } catch (const brume::Error& error) {
        std::cerr << "brume_scenes: " << error.what() << '\n';
        return int(error.kind());
    } catch (const std::exception& error) {
        std::cerr << "brume_scenes: " << error.what() << '\n';
        return 3;
    }
    return 0;
}
