// What `brume preview` was told, and the door to the module that holds the window.
#pragma once

#include <opencv2/core/types.hpp>
#include <string>

#include "frame/read.hpp"
#include "preview/frame_words.hpp"

namespace brume::preview {

struct PreviewOptions {
    FrameWords words;
    double maxPixels = double(ReadOptions().maxPixels);  ///< of any frame, those dropped on the window too
    std::string preset;
    std::string backend = "gl";
    std::string show = "result";  ///< result, before, wipe, blink, depth, difference, or an image's name
    cv::Size window;              ///< px; empty: as it was last
    std::string screenshot;       ///< write the window here once the picture is there, and end
    std::string state;            ///< for tests and tools: what the window shows, as JSON, kept up to date
    std::string trace;            ///< one line of JSON for each picture that reached the window
};

/// Module "preview", "brumeRunPreview": returns when the window is closed. Throws Error (Usage): no display,
/// no OpenGL 4.5.
using RunPreviewFunction = void(const PreviewOptions& options);

}  // namespace brume::preview
