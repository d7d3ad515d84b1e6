#include "frame/write.hpp"

#include <bit>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <opencv2/core/utility.hpp>

#include "error.hpp"
#include "frame/alpha.hpp"
#include "frame/color_encoding.hpp"
#include "frame/image_file.hpp"
#include "frame/image_writers.hpp"
#include "frame/pending_file.hpp"
#include "modules/module.hpp"
#include "nearest_name.hpp"

namespace brume {

namespace {

std::string endingOf(const std::string& path) {
    std::string ending = std::filesystem::path(path).extension().string();
    for (char& c : ending) c = char(std::tolower(static_cast<unsigned char>(c)));
    return ending == ".jpeg" ? ".jpg" : ending == ".tiff" ? ".tif" : ending;
}

cv::Mat withoutAlpha(const cv::Mat& rgba) {
    cv::Mat rgb(rgba.size(), CV_32FC3);
    const int fromTo[] = {0, 0, 1, 1, 2, 2};
    cv::mixChannels(rgba, rgb, fromTo, 3);
    return rgb;
}

ExrContent colorContent(const cv::Mat& rgba, const WriteOptions& options) {
    ExrContent content;
    content.alpha = !isOpaque(rgba);
    if (content.alpha)
        premultiply(rgba, content.color);
    else
        content.color = rgba;
    content.halfColor = options.halfColor && !options.isData;
    content.attributes = options.attributes;
    return content;
}

/// Numbers from 0 on as 16 bits, in PNG's byte order. The smallest scale is 1/65535: transmittance fills the
/// range. One channel is depth: 0 means unknown, the largest word sky.
cv::Mat toWords(const cv::Mat& numbers, double& scale) {
    const bool isDepth = numbers.channels() == 1;
    const int largestWord = isDepth ? 65534 : 65535;
    const int width = numbers.cols * numbers.channels();
    float largest = 1;
    for (int j = 0; j < numbers.rows; ++j)
        for (int k = 0; k < width; ++k) {
            const float x = numbers.ptr<float>(j)[k];
            if (std::isfinite(x) && x > largest) largest = x;
        }
    scale = double(largest) / largestWord;
    cv::Mat words(numbers.size(), CV_16UC(numbers.channels()));
    for (int j = 0; j < numbers.rows; ++j) {
        const float* in = numbers.ptr<float>(j);
        uint16_t* out = words.ptr<uint16_t>(j);
        for (int k = 0; k < width; ++k) {
            int word = std::isnan(in[k]) || in[k] <= 0 ? 0 : 65535;
            if (std::isfinite(in[k]) && in[k] > 0)
                word = std::max(isDepth ? 1 : 0, int(std::lround(double(in[k]) / scale)));
            out[k] =
                std::endian::native == std::endian::little ? uint16_t(word << 8 | word >> 8) : uint16_t(word);
        }
    }
    return words;
}

void requireImage(const cv::Mat& image) {
    if (image.empty() || (image.type() != CV_32FC4 && image.type() != CV_32F))
        failUsage("an image to write must have one or four channels of float32");
}

/// Errors about the hidden file beside the target must name the target.
template <class Fill>
void writeWhole(const std::string& path, Fill fill) {
    PendingFile pending(path);
    try {
        fill(pending.path());
    } catch (const Error& e) {
        std::string sentence = e.what();
        for (size_t at; (at = sentence.find(pending.path())) != std::string::npos;)
            sentence.replace(at, pending.path().size(), path);
        throw Error(e.kind(), sentence);
    }
    pending.commit();
}

}  // namespace

void writeNpy(const std::string& path, const cv::Mat& pixels) {
    const std::string order = std::endian::native == std::endian::little ? "<" : ">";
    std::string header =
        text("{'descr': '", order, "f4', 'fortran_order': False, 'shape': (", pixels.rows, ", ", pixels.cols,
             pixels.channels() > 1 ? text(", ", pixels.channels()) : "", "), }");
    while ((10 + header.size() + 1) % 64 != 0) header += ' ';
    header += '\n';
    const std::string magic("\x93NUMPY\x01\x00", 8);
    std::vector<unsigned char> bytes(magic.begin(), magic.end());
    bytes.push_back(static_cast<unsigned char>(header.size() & 0xff));
    bytes.push_back(static_cast<unsigned char>(header.size() >> 8));
    bytes.insert(bytes.end(), header.begin(), header.end());
    for (int j = 0; j < pixels.rows; ++j)
        bytes.insert(bytes.end(), pixels.ptr(j), pixels.ptr(j) + pixels.cols * pixels.elemSize());
    writeBytes(path, {bytes});
}

void writeThroughOpenImageIo(const std::string& path, const cv::Mat& pixels, bool srgb,
                             const TextAttributes& attributes) {
    moduleFunction<WriteImageFunction>("image_formats", "brumeWriteImage")(path, pixels, srgb, attributes);
}

void requireWritableEnding(const std::string& path) {
    static const std::vector<std::string> endings = {".exr", ".png", ".jpg", ".tif", ".npy"};
    const std::string ending = endingOf(path);
    if (std::find(endings.begin(), endings.end(), ending) == endings.end())
        failUsage(path, ": images are written as .exr, .png, .jpg, .tif or .npy, not ",
                  ending.empty() ? "without an ending" : ending);
}

void writeImage(const std::string& path, const cv::Mat& image, const WriteOptions& options) {
    requireWritableEnding(path);
    requireImage(image);
    const std::string ending = endingOf(path);
    const bool color = image.channels() == 4;
    if (options.isData && ending == ".jpg")
        failUsage(path, ": numbers need .exr, .tif, .npy or .png; .jpg holds 8-bit pictures");
    writeWhole(path, [&](const std::string& file) {
        if (ending == ".exr") {
            ExrContent content = color ? colorContent(image, options) : ExrContent();
            if (!color) {
                content.grey = image;
                content.halfColor = options.halfColor && !options.isData;
                content.attributes = options.attributes;
            }
            writeExr(file, content);
        } else if (ending == ".npy") {
            writeNpy(file, color && isOpaque(image) ? withoutAlpha(image) : image);
        } else if (ending == ".tif") {
            writeThroughOpenImageIo(file, color && isOpaque(image) ? withoutAlpha(image) : image, false,
                                    options.attributes);
        } else if (options.isData) {
            double scale = 0;
            const cv::Mat words = toWords(color && isOpaque(image) ? withoutAlpha(image) : image, scale);
            TextAttributes attributes = options.attributes;
            attributes["brume:scale"] = text(std::setprecision(17), scale);
            writePng(file, words, attributes);
        } else {
            const bool alpha = color && ending == ".png" && !isOpaque(image);
            const cv::Mat bytes = toSrgb8(image, alpha, options.frameIndex, options.seed);
            if (ending == ".png")
                writePng(file, bytes, options.attributes);
            else
                writeThroughOpenImageIo(file, bytes, true, options.attributes);
        }
    });
}

void writeFrame(const std::string& path, const FramePair& frame, const WriteOptions& options) {
    if (endingOf(path) != ".exr") failUsage(path, ": colour and depth in one file need .exr");
    requireImage(frame.color);
    ExrContent content = colorContent(frame.color, options);
    content.depth = frame.depth;
    content.statements = {frame.camera, frame.time, DepthEncoding{}, frame.extras};
    content.folder = std::filesystem::path(path).parent_path().string();
    writeWhole(path, [&](const std::string& file) { writeExr(file, content); });
}

}  // namespace brume
