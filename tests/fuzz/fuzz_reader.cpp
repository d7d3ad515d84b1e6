// JPEG, TIFF, HDR as brume reads them: through brume_reader, which libraries may bring down and brume must
// not mind. Those are not instrumented, so what guides the search is what comes back: each sentence, each
// kind of image.
#include <cctype>
#include <functional>

#include "frame/image_file.hpp"
#include "fuzz_input.hpp"

using namespace brume;

namespace {

__attribute__((section("__libfuzzer_extra_counters"))) uint8_t outcomes[1 << 12];

void note(const std::string& outcome) {
    std::string kind;
    for (const char c : outcome)
        if (std::isalpha(static_cast<unsigned char>(c))) kind += c;
    outcomes[std::hash<std::string>()(kind) % sizeof outcomes] = 1;
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
    // For the reader's process: a crash in a library is its own, a report on brume's code is status 86.
    setenv("ASAN_OPTIONS",
           "handle_segv=0:handle_abort=0:handle_sigbus=0:handle_sigfpe=0:exitcode=86:detect_leaks=0:"
           "allocator_may_return_null=1:max_allocation_size_mb=1024",
           1);
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static fuzz::MemoryFile file;
    const std::string& path = file.holding(data, size);
    try {
        const FileFormat format = formatOf(path);
        if (format != FileFormat::Jpeg && format != FileFormat::Tiff && format != FileFormat::Hdr) return 0;
        const StoredImage image = loadImage(path, 1 << 16);
        note(std::to_string(int(format)) + "read" + std::string(size_t(image.pixels.type()), 'x') +
             (image.premultiplied ? "premultiplied" : "") + (image.srgb ? "srgb" : ""));
    } catch (const Error& e) {
        const std::string sentence = e.what();
        // Brume's own fault, or a process that decodes nothing at all.
        for (const char* never : {"ended with status", "cannot be loaded", "cannot be started"})
            if (sentence.find(never) != std::string::npos) std::abort();
        note(sentence.substr(std::min(path.size(), sentence.size())));
    }
    return 0;
}
