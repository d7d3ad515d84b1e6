#include "options.hpp"

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "cpu/cpu_runner.hpp"
#include "error.hpp"
#include "frame/depth_encoding.hpp"
#include "frame/sidecar.hpp"
#include "gl/gl_runner.hpp"
#include "gl/pass_watch.hpp"
#include "nearest_name.hpp"

namespace brume::host {
namespace {

const std::vector<std::string> backendNames = {"auto", "cpu", "gl", "osmesa", "egl"};

// Asking EGL takes a tenth of a second; a machine without these has no GPU to offer.
bool mayHaveGpu() {
    std::error_code none;
    for (const auto& entry : std::filesystem::directory_iterator("/dev/dri", none))
        if (entry.path().filename().string().starts_with("renderD")) return true;
    return std::filesystem::exists("/dev/nvidiactl", none);
}

}  // namespace

cv::Size parseSize(const std::string& size) {
    int width = 0, height = 0;
    char rest = 0;
    if (std::sscanf(size.c_str(), "%dx%d%c", &width, &height, &rest) != 2 || width < 1 || height < 1 ||
        int64_t(width) * height > 1 << 26)
        failUsage("--size: '", size, "' should be WIDTHxHEIGHT, such as 1920x1080");
    return {width, height};
}

void FrameOptions::addTo(CLI::App& command) {
    command.add_option(
        "--depth", depth,
        "Where depth is: a file, a pattern such as 'depth/{stem}.png' or 'd.####.exr', a folder, or a "
        "list; or none: all is sky (default: Z in the frame's EXR, what its sidecar names, or NAME.depth.EXT "
        "beside it)");
    command.add_option(
        "--depth-encoding", encoding,
        "What the depth file's numbers mean: a ready-made name (" +
            CLI::detail::join(depthEncodingNames(), ", ") +
            "), then details, as in 'opengl:near=.1,far=100' (default: what the sidecar says)");
    command.add_option("--camera", camera,
                       "Where the camera was, in place of what sidecars say: their keys, as in "
                       "'horizontal_view_degrees=75,height=1.5' or "
                       "'fx=525,fy=525,cx=319.5,cy=239.5,pixel_centres=whole'");
    command.add_option("--color", color,
                       "What the colour file holds: srgb or linear (default: by its format)");
    addMaxPixels(command, maxPixels);
}

void addMaxPixels(CLI::App& command, double& maxPixels) {
    command.add_option("--max-pixels", maxPixels, "Refuse images of more pixels, before memory is taken")
        ->check(numberIn(1, 1e12))
        ->default_str("2^28");
}

ReadOptions FrameOptions::read() const {
    ReadOptions options;
    options.depth = depth;
    options.maxPixels = size_t(maxPixels);
    if (!encoding.empty()) options.encoding = parseDepthEncoding(encoding);
    if (!camera.empty()) options.camera = parseCamera(camera);
    if (!color.empty()) {
        if (color != "srgb" && color != "linear")
            failUsage("--color: no choice '", color, "'", suggestion(color, {"srgb", "linear"}));
        options.colorIsSrgb = color == "srgb";
    }
    return options;
}

CLI::Validator numberIn(double least, double most) {
    const std::string range = text("in [", least, " - ", most, "]");
    return CLI::Validator(
        [=](std::string& word) {
            double number = 0;
            const bool isIn = CLI::detail::lexical_cast(word, number) && number >= least && number <= most;
            return isIn ? "" : text("Value ", word, " not ", range);
        },
        "FLOAT " + range);
}

void addPassSeconds(CLI::App& command) {
    command
        .add_option_function<double>("--pass-seconds", setPassLimit,
                                     "Give up where one pass of a shader takes longer")
        ->check(numberIn(.1, 1e6))
        ->default_str(text(passLimit()));
}

void BackendOption::addTo(CLI::App& command) {
    command
        .add_option("--backend", name,
                    "cpu, gl (the best OpenGL there is), osmesa, egl, or auto: a GPU if there is one, else "
                    "the CPU")
        ->capture_default_str();
    addPassSeconds(command);
}

void BackendOption::validate() const {
    if (std::find(backendNames.begin(), backendNames.end(), name) == backendNames.end())
        failUsage("--backend: no backend '", name, "'", suggestion(name, backendNames));
}

std::unique_ptr<Runner> BackendOption::makeRunner(const Chain& chain) const {
    validate();
    if (name == "cpu") return makeCpuRunner();
    if (name == "gl") return makeGlRunner(GlPlatform::Auto);
    if (name == "osmesa") return makeGlRunner(GlPlatform::Osmesa);
    if (name == "egl") return makeGlRunner(GlPlatform::Egl);
    if (chain.needsGl()) return makeGlRunner(GlPlatform::Auto);
    if (mayHaveGpu()) try {
            auto thread = std::make_shared<GlThread>(GlPlatform::Egl);
            bool isHardware = false;
            thread->run([&](GlContext& context) { isHardware = context.isHardware(); });
            if (isHardware) return makeGlRunner(thread);
        } catch (const Error&) {  // no usable EGL: the CPU it is
        }
    return makeCpuRunner();
}

}  // namespace brume::host
