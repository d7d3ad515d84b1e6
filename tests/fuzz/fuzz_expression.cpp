// A size expression: parsed, its names collected, evaluated.
#include "effect/size_expression.hpp"
#include "fuzz_input.hpp"
#include "repeats.hpp"

using namespace brume;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    fuzz::acceptedOrRefused([&] {
        const SizeExpression expression(std::string(data, data + size));
        expression.names();
        if (!expression.empty())
            expression.evaluate({{"WIDTH", 640}, {"HEIGHT", 480}, {"radius", 2.5}, {"zero", 0}});
    });
    return 0;
}
