// PNG, NPY, PFM, DPT: readers of brume's own or through libpng, then everything a frame's colour and depth go
// through.
#include "frame/decode.hpp"
#include "frame/image_file.hpp"
#include "frame/read.hpp"
#include "fuzz_input.hpp"

using namespace brume;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static fuzz::MemoryFile file;
    decodeInThisProcess();
    const std::string& path = file.holding(data, size);
    fuzz::acceptedOrRefused([&] {
        const FileFormat format = formatOf(path);
        const bool isOurs = format == FileFormat::Png || format == FileFormat::Npy ||
                            format == FileFormat::Pfm || format == FileFormat::Dpt;
        if (!isOurs) return;  // EXR has its own target; the others run in a process apart
        ReadOptions options;
        options.maxPixels = 1 << 18;
        options.depth = path;
        options.encoding = parseDepthEncoding("linear:scale_to_metres=.001,unknown=0");
        readFrame(path, options);
    });
    return 0;
}
