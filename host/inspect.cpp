// brume inspect: what a capture is, and what looks wrong with its depth.
#include "frame/inspect.hpp"

#include <cmath>
#include <filesystem>
#include <iomanip>
#include <iostream>

#include "commands.hpp"
#include "error.hpp"
#include "file_status.hpp"
#include "frame/attributes.hpp"
#include "frame/sequence.hpp"
#include "frame/write.hpp"
#include "options.hpp"
#include "output_names.hpp"
#include "record.hpp"
#include "shell_word.hpp"

namespace brume::host {
namespace {

struct Arguments {
    std::vector<std::string> frames;
    FrameOptions options;
    std::string picture;
};

void printStatistics(const FramePair& frame) {
    const DepthStatistics s = depthStatistics(frame.depth);
    std::cout << "  size      " << frame.size().width << " × " << frame.size().height << "\n"
              << "  depth     " << s.least << " to " << s.greatest << " m; 1 % " << s.p1 << ", 10 % " << s.p10
              << ", median " << s.median << ", 90 % " << s.p90 << ", 99 % " << s.p99 << "\n"
              << "  sky       " << s.sky * 100 << " %\n"
              << "  unknown   " << s.unknown * 100 << " %\n";
    const Camera& c = frame.camera;
    const auto degrees = [](double length, double focal) {
        return 2 * std::atan(length / 2 / focal) * 180 / M_PI;
    };
    std::cout << "  camera    " << degrees(frame.size().width, c.fx) << "° × "
              << degrees(frame.size().height, c.fy) << "°, f " << c.fx << ", " << c.fy << " px, centre "
              << c.cx << ", " << c.cy << ", eye " << c.eye()[1] << " m up\n";
}

/// Where the pictures of several frames go: the file itself for one, else a folder.
std::string pictureOf(const std::string& picture, const FramePair& frame, bool several) {
    if (!several) return picture;
    std::filesystem::create_directories(picture);
    return (std::filesystem::path(picture) / (frame.name + ".inspect.png")).string();
}

// How brume made the picture, where it did and says so.
std::optional<Making> printMaking(const std::string& path) {
    const auto record = canHoldAttributes(path) ? readRecord(path) : std::nullopt;
    if (!record) return {};
    const Making making = makingOf(*record, path);
    std::cout << "  made by   brume " << record->at("version").get<std::string>() << " on " << making.backend
              << " from " << making.input << (making.frame.depth.empty() ? "" : " and " + making.frame.depth)
              << ", seed " << making.seed << ", frame " << making.index << "\n";
    for (const auto& [parameter, value] : making.settings)
        std::cout << "  set       " << parameter << " = " << value << "\n";
    std::cout << "  preset    " << *making.preset << "\n";
    const std::string stale = staleness(*record, making);
    std::cout << (stale.empty() ? "  its input is as it was" : "  it " + stale)
              << "; again: brume apply --like " << shellWord(path) << " -o COPY\n";
    return making;
}

void inspectOne(const FrameFiles& files, const Arguments& a, bool several) {
    std::cout << files.color << "\n";
    // A picture that brume made without depth is no frame: there is nothing more to say of it.
    if (const auto making = printMaking(files.color); making && !making->withDepth && files.depth.empty())
        return;
    ReadOptions options = a.options.read();
    options.depth = files.depth;
    const Capture capture = readCapture(files.color, options);
    for (const std::string& note : capture.frame.notes) std::cout << "  " << note << "\n";
    DepthEncoding encoding;
    const bool ranked = !capture.stated;
    std::vector<Reading> readings;
    if (ranked) {
        readings = rankReadings(capture);
        if (readings.empty()) failIo(capture.depthPath, ": holds no number above 0");
        std::cout << "  what the depth's numbers mean is not stated; by the geometry it would give:\n";
        for (const Reading& r : readings)
            std::cout << "    " << std::setprecision(2) << std::fixed << r.score << std::defaultfloat
                      << std::setprecision(6) << "  " << r.name << ": " << r.evidence << "\n";
        encoding = capture.habit ? *capture.habit : readings.front().encoding;
        std::cout << "  read below as " << (capture.habit ? "such files usually are" : readings.front().name)
                  << "\n";
    } else {
        encoding = *capture.stated;
    }
    const FramePair frame = decodeCapture(capture, encoding);
    std::cout << "  depth     " << encoding.describe() << "\n";
    printStatistics(frame);
    const std::vector<Doubt> doubts = findDoubts(capture, encoding);
    for (const Doubt& d : doubts) std::cout << "  doubt: " << d.name << ": " << d.evidence << "\n";
    if (doubts.empty()) std::cout << "  nothing looks wrong\n";
    if (a.picture.empty()) return;
    const std::string path = pictureOf(a.picture, frame, several);
    requireNotRead(path, frame.files);
    writeImage(path, inspectionPicture(frame));
    std::cout << "  picture   " << path << "\n";
    if (!ranked) return;
    const std::filesystem::path p(path);
    const std::string candidates =
        (p.parent_path() / (p.stem().string() + ".readings" + p.extension().string())).string();
    writeImage(candidates, readingsPicture(capture, readings, 320));
    std::cout << "  readings  " << candidates << "\n";
}

}  // namespace

void addInspect(CLI::App& program) {
    auto* command = program.add_subcommand(
        "inspect", "What a capture is, and what looks wrong with its depth; how brume made a picture");
    auto a = std::make_shared<Arguments>();
    command->add_option("frame", a->frames, "Frames: files, folders, patterns such as shot.####.exr, lists")
        ->required();
    a->options.addTo(*command);
    command->add_option(
        "--picture", a->picture,
        "Write colour, depth and histogram side by side here (a folder for several frames), and, "
        "where the encoding is not stated, the readings it could have");
    command->callback([a] {
        a->options.read();
        if (!a->picture.empty() && a->frames.size() == 1)
            requireWritableEnding(a->picture + (isFolder(a->picture) ? "/x.png" : ""));
        const std::vector<FrameFiles> files = expandFrames(a->frames, a->options.depth);
        for (const FrameFiles& f : files) inspectOne(f, *a, files.size() > 1 || isFolder(a->picture));
    });
}

}  // namespace brume::host
