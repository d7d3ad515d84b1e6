// An effect file: its description, JSON or nearly, its size expressions, and the rewriting of foreign GLSL.
#include "effect/header.hpp"
#include "fuzz_input.hpp"
#include "gl/isf_rewrite.hpp"
#include "repeats.hpp"

using namespace brume;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const std::string text(data, data + size);
    fuzz::acceptedOrRefused([&] {
        const EffectHeader header = parseHeader("fuzz.fs", text);
        expressionVariables(header, defaultValues(header.parameters));
    });
    IsfUses uses;
    rewriteIsf(text, size % 2 ? IsfStage::Fragment : IsfStage::Vertex, {"RENDERSIZE", "inputImage"}, uses);
    return 0;
}
