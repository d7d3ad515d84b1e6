// A preset, and that what is written of it reads back.
#include "effect/preset.hpp"
#include "fuzz_input.hpp"
#include "repeats.hpp"

using namespace brume;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static const EffectRegistry registry({BRUME_FUZZ_EFFECTS});
    const std::string text(data, data + size);
    Chain chain;
    if (fuzz::acceptedOrRefused([&] { chain = parsePreset(text, "fuzz.json", registry); })) {
        const std::string written = writePreset(chain);
        if (writePreset(parsePreset(written, "again.json", registry)) != written) std::abort();
    }
    return 0;
}
