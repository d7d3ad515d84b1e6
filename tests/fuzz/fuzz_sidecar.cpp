// NAME.json beside a picture: depth encoding, camera, lights; and depth encodings as the command line writes
// them.
#include <fstream>

#include "frame/depth_encoding.hpp"
#include "frame/sidecar.hpp"
#include "fuzz_input.hpp"
#include "repeats.hpp"

using namespace brume;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static const std::string stem = "/dev/shm/brume-fuzz-" + std::to_string(getpid());
    std::ofstream(stem + ".json", std::ios::binary).write(reinterpret_cast<const char*>(data), long(size));
    fuzz::acceptedOrRefused([&] { readSidecar(stem + ".png").camera({640, 480}); });
    fuzz::acceptedOrRefused([&] { parseDepthEncoding(std::string(data, data + size)); });
    unlink((stem + ".json").c_str());
    return 0;
}
