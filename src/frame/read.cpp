#include "frame/read.hpp"

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <opencv2/core/utility.hpp>

#include "error.hpp"
#include "frame/alpha.hpp"
#include "frame/capture.hpp"
#include "frame/color_encoding.hpp"
#include "frame/decode.hpp"
#include "frame/exr_attributes.hpp"
#include "frame/guided_depth.hpp"
#include "frame/image_file.hpp"
#include "frame/light_maps.hpp"
#include "frame/pairing.hpp"
#include "frame/sidecar.hpp"

namespace brume {

namespace {

/// A depth file's numbers, one channel, and what can be said of them without being told.
struct StoredDepth {
    std::string path;
    cv::Mat pixels;
    std::optional<DepthEncoding> stated;  ///< by the file itself
    std::optional<DepthEncoding> habit;   ///< nothing: integers, which might be anything
};

std::string sizeText(cv::Size size) { return text(size.width, " × ", size.height); }

DepthEncoding renderedDepth(bool centimetres) {
    DepthEncoding e;
    e.scaleToMetres = centimetres ? .01 : 1;
    e.zeroIsSky = true;
    return e;
}

/// Depth saved as a picture has three equal channels.
cv::Mat singleChannel(const cv::Mat& pixels, const std::string& path) {
    if (pixels.channels() == 1) return pixels;
    std::vector<cv::Mat> planes;
    cv::split(pixels, planes);
    const auto equal = [](const cv::Mat& a, const cv::Mat& b) {
        cv::Mat different;
        cv::bitwise_xor(a, b, different);
        return cv::countNonZero(different.reshape(1)) == 0;
    };
    if (planes.size() >= 3 && !(equal(planes[0], planes[1]) && equal(planes[0], planes[2])))
        failIo(path, ": is no depth image: its red, green and blue differ");
    return planes[0];
}

StoredDepth readDepthFile(const std::string& path, size_t maxPixels) {
    StoredDepth depth;
    depth.path = path;
    if (formatOf(path) == FileFormat::Exr) {
        const Decoded decoded = decode({Decode::Depth, path, maxPixels});
        depth.pixels = decoded.images.at(0);
        depth.habit = renderedDepth(decoded.facts.at("centimetres"));
        depth.stated = getStatements(decoded.facts.at("attributes"), path).encoding;
        return depth;
    }
    const StoredImage image = loadImage(path, maxPixels);
    depth.pixels = singleChannel(image.pixels, path);
    if (depth.pixels.depth() == CV_32F) depth.habit = DepthEncoding();
    return depth;
}

struct StoredPair {
    cv::Mat color;  ///< CV_32FC4, linear, unassociated
    std::optional<StoredDepth> depth;
    ExrStatements stated;
    std::vector<std::string> notes;
};

StoredPair readExrPair(const std::string& path, bool wantDepth, std::optional<bool> srgb, size_t maxPixels) {
    const Decoded decoded = decode({Decode::Pair, path, maxPixels, wantDepth});
    StoredPair pair;
    pair.stated = getStatements(decoded.facts.at("attributes"), path);
    pair.notes = decoded.facts.at("notes").get<std::vector<std::string>>();
    pair.color = decoded.images.at(0);
    if (decoded.images.size() > 1)
        pair.depth = StoredDepth{path, decoded.images[1], pair.stated.encoding,
                                 renderedDepth(decoded.facts.at("centimetres"))};
    if (srgb.value_or(false)) pair.color = toLinearRgba(pair.color, true);
    return pair;
}

cv::Mat decodeColor(const StoredImage& image, std::optional<bool> srgb) {
    const bool curve = srgb.value_or(image.srgb.value_or(image.pixels.depth() != CV_32F));
    cv::Mat rgba = toLinearRgba(image.pixels, curve);
    if (image.premultiplied) unpremultiply(rgba);
    return rgba;
}

void requireSomeDepth(const cv::Mat& depth, const std::string& path) {
    for (int j = 0; j < depth.rows; ++j) {
        const float* z = depth.ptr<float>(j);
        for (int i = 0; i < depth.cols; ++i)
            if (!std::isnan(z[i])) return;
    }
    failIo(path, ": depth is unknown everywhere");
}

/// Another size is brought to the colour's; another shape is another view.
void requireSameShape(const std::string& colorPath, cv::Size color, const std::string& depthPath,
                      cv::Size depth) {
    const double stretch = double(color.width) / color.height * depth.height / depth.width;
    if (color != depth && std::abs(std::log(stretch)) > .02)
        failIo(depthPath, ": depth is ", sizeText(depth), " pixels, another shape than the colour of ",
               colorPath, ", ", sizeText(color));
}

}  // namespace

Capture readCapture(const std::string& path, const ReadOptions& options) {
    const FileFormat format = formatOf(path);
    const Sidecar sidecar = readSidecar(path);
    const std::optional<bool> srgb = options.colorIsSrgb ? options.colorIsSrgb : sidecar.colorIsSrgb;

    std::string depthPath = options.depth.empty() ? sidecar.depthFile : options.depth;
    StoredPair pair;
    if (format == FileFormat::Exr)
        pair = readExrPair(path, depthPath.empty(), srgb, options.maxPixels);
    else
        pair.color = decodeColor(loadImage(path, options.maxPixels), srgb);
    const bool isWithout = depthPath == noDepth;
    if (isWithout) {
        const DepthEncoding metres;
        pair.depth = {path, cv::Mat(pair.color.size(), CV_32F, cv::Scalar(HUGE_VAL)), metres, metres};
    } else if (!pair.depth) {
        if (depthPath.empty()) {
            const std::vector<std::string> beside = depthFilesBeside(path);
            if (beside.size() > 1) failIo(ambiguity(path, beside[0], beside[1]));
            if (!beside.empty()) depthPath = beside[0];
        }
        if (depthPath.empty())
            failIo(
                path, ": has no depth: neither a channel Z nor ", stemOf(path),
                ".depth.EXT beside it; name it with --depth, or say --depth none for effects that need none");
        pair.depth = readDepthFile(depthPath, options.maxPixels);
    }
    const StoredDepth& stored = *pair.depth;
    requireSameShape(path, pair.color.size(), stored.path, stored.pixels.size());

    Capture capture;
    capture.stored = stored.pixels;
    capture.depthPath = stored.path;
    capture.habit = stored.habit;
    capture.stated = isWithout          ? stored.stated
                     : options.encoding ? options.encoding
                     : sidecar.encoding ? sidecar.encoding
                                        : stored.stated;
    // What a renderer leaves empty stays sky unless 0 was declared unknown.
    if (capture.stated && stored.habit && stored.habit->zeroIsSky) capture.stated->zeroIsSky = true;

    FramePair& frame = capture.frame;
    frame.name = stemOf(path);
    frame.color = pair.color;
    frame.notes = pair.notes;
    frame.files = {path};
    if (stored.path != path) frame.files.push_back(stored.path);
    if (!sidecar.path.empty()) frame.files.push_back(sidecar.path);
    frame.time = sidecar.time.value_or(pair.stated.time.value_or(0));
    frame.extras = sidecar.extras ? sidecar.extras : pair.stated.extras;
    readLightMaps(frame, options.maxPixels);
    std::optional<Camera> camera = options.camera ? cameraFromJson(*options.camera, frame.size(), "camera")
                                                  : sidecar.camera(frame.size());
    capture.poseIsStated =
        options.camera ? statesPose(*options.camera) : pair.stated.camera.has_value() || sidecar.statesPose();
    if (!camera) camera = pair.stated.camera;
    frame.cameraIsStated = camera.has_value();
    frame.camera = camera ? *camera : Camera::withHorizontalView(frame.size(), 60);
    if (!camera) frame.notes.push_back("camera: not stated, assumed 60° wide, level, 1.6 m up");
    return capture;
}

FramePair decodeCapture(const Capture& capture, const DepthEncoding& encoding) {
    FramePair frame = capture.frame;
    const cv::Size from = capture.stored.size(), to = frame.size();
    frame.depth = decodeDepth(capture.stored, encoding, frame.camera.resized(to, from));
    requireSomeDepth(frame.depth, capture.depthPath);
    frame.notes.push_back("depth: " + encoding.describe() + (capture.stated ? "" : " (assumed)"));
    if (from == to) return frame;
    frame.depth = depthAtSize(frame.color, frame.depth);
    frame.notes.push_back("depth: brought from " + sizeText(from) + " to " + sizeText(to) +
                          (from.width < to.width ? " along colour edges" : ""));
    return frame;
}

FramePair readFrame(const std::string& path, const ReadOptions& options) {
    const Capture capture = readCapture(path, options);
    if (!capture.stated && !capture.habit)
        failIo(
            capture.depthPath,
            ": integers, and nothing says what they mean; state it with --depth-encoding, such as 'tum' or "
            "'linear:scale_to_metres=.001,unknown=0', or in ",
            capture.frame.name, ".json; brume inspect ranks what they could be");
    return decodeCapture(capture, capture.stated ? *capture.stated : *capture.habit);
}

cv::Mat readImage(const std::string& path, size_t maxPixels) {
    const StoredImage image = loadImage(path, maxPixels);
    cv::Mat pixels;
    const double scale = image.pixels.depth() == CV_8U    ? 1 / 255.
                         : image.pixels.depth() == CV_16U ? 1 / 65535.
                                                          : 1;
    image.pixels.convertTo(pixels, CV_32F, scale);
    return pixels;
}

cv::Mat readColor(const std::string& path, size_t maxPixels) {
    return decodeColor(loadImage(path, maxPixels), std::nullopt);
}

}  // namespace brume
