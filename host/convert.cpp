// brume convert: any accepted pair to the one-file form.
#include <filesystem>
#include <iostream>

#include "commands.hpp"
#include "error.hpp"
#include "file_status.hpp"
#include "frame/sequence.hpp"
#include "frame/write.hpp"
#include "options.hpp"

namespace brume::host {
namespace {

struct Arguments {
    std::vector<std::string> frames;
    FrameOptions options;
    std::string out;
    bool half = false;
};

}  // namespace

void addConvert(CLI::App& program) {
    auto* command = program.add_subcommand(
        "convert", "Colour, depth and camera of a frame into one EXR, with nothing lost");
    auto a = std::make_shared<Arguments>();
    command->add_option("frame", a->frames, "Frames: files, folders, patterns such as shot.####.exr, lists")
        ->required();
    command->add_option("-o,--output", a->out, "The EXR to write, or a folder for several frames")
        ->required();
    a->options.addTo(*command);
    command->add_flag("--half", a->half, "Store colour as half floats: smaller, 11 bits of precision");
    command->callback([a] {
        const ReadOptions options = a->options.read();
        const std::vector<FrameFiles> files = expandFrames(a->frames, a->options.depth);
        const std::filesystem::path out(a->out);
        const bool folder = out.extension() != ".exr";
        if (folder && !out.extension().empty() && !isFolder(a->out) && !a->out.ends_with('/'))
            failUsage("-o ", a->out,
                      ": convert writes EXR, which holds colour, depth and camera in one file: name it ",
                      out.stem().string(), ".exr, or end a folder's name with '/'");
        if (!folder && files.size() > 1)
            failUsage("-o ", a->out, ": ", files.size(), " frames need a folder, not one file");
        if (folder) {
            std::error_code error;
            std::filesystem::create_directories(out, error);
            if (error) failIo(a->out, ": cannot be made a folder: ", error.message());
        }
        WriteOptions write;
        write.halfColor = a->half;
        for (size_t k = 0; k < files.size(); ++k) {
            const FramePair frame = readFrame(files[k], int(k), options);
            const std::string path = folder ? (out / (frame.name + ".exr")).string() : a->out;
            for (const std::string& read : frame.files)
                if (std::error_code none; std::filesystem::equivalent(read, path, none))
                    failUsage("-o ", path, ": would overwrite what it is made from");
            writeFrame(path, frame, write);
            std::cout << path << "\n";
        }
    });
}

}  // namespace brume::host
