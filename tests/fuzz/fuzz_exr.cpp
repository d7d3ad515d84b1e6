// EXR: headers, layers, deep pixels, attributes. OpenEXR itself is not instrumented.
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
        if (formatOf(path) != FileFormat::Exr) return;
        ReadOptions options;
        options.maxPixels = 1 << 16;
        readFrame(path, options);
    });
    return 0;
}
