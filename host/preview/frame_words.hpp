// What the command line said about frames, word for word, so that it can be said again.
#pragma once

#include <string>
#include <vector>

namespace brume::preview {

struct FrameWords {
    std::vector<std::string> frames;
    std::string depth, encoding, camera, color;  ///< --depth, --depth-encoding, ...; empty: not said
    double framesPerSecond = 24;
};

}  // namespace brume::preview
