// Decoding image files through libraries that a damaged or hostile file can bring down (OpenEXR,
// OpenImageIO): in a process apart, with limits on time and memory, so that the worst such a file can do is a
// sentence.
#pragma once

#include <nlohmann/json.hpp>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

namespace brume {

enum class Decode {
    Image,   ///< any format: images[0] as StoredImage's; facts: "premultiplied", "srgb" where stated
    Pair,    ///< EXR: images[0] colour CV_32FC4, unpremultiplied, images[1] depth CV_32F if wanted and there;
             ///< facts: "attributes", "notes", "centimetres"
    Depth,   ///< EXR: images[0] depth CV_32F; facts: "attributes", "centimetres"
    Header,  ///< EXR: no image; facts: "width", "height", "attributes"
};

struct DecodeRequest {
    Decode what = Decode::Image;
    std::string path;
    size_t maxPixels = 0;
    bool wantDepth = true;               ///< of Pair
    std::optional<double> seconds = {};  ///< of processor time, instead of the usual limit
    std::optional<size_t> memory = {};   ///< bytes beyond what the reader has, instead of the usual limit
};

/// Plain data, so that it can come from another process. "attributes" holds the header's numbers, texts and
/// 4×4 matrices (16 numbers, row by row) by name.
struct Decoded {
    std::vector<cv::Mat> images;
    nlohmann::json facts;
};

/// Decodes in the reader's process (brume_reader, started when first needed, kept for the next file). Throws
/// Error (Io): what the format's reader says, or that the file crashed it, took too long or too much memory.
/// Safe from several threads: each has a process of its own while it decodes.
///
/// Limits: processor time 30 s and 1 s more for each MiB of the file (raisedBy maxPixels), and 20 times that
/// by the clock; private memory 1 GiB and 32 bytes for each pixel that maxPixels allows, but no more than the
/// machine's memory.
Decoded decode(const DecodeRequest& request);

/// The same in this process: for brume_reader itself, and for fuzzing.
Decoded decodeHere(const DecodeRequest& request);

/// From now on `decode` decodes in this process.
void decodeInThisProcess();

}  // namespace brume
