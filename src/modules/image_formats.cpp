// JPEG, TIFF and HDR through OpenImageIO, behind a door that opens only when needed.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <opencv2/core.hpp>

#include "error.hpp"
#include "modules/module.hpp"

using namespace brume;

namespace {

/// Where a JPEG is cut off, libjpeg makes up the rest in grey and only warns.
void requireEndOfJpeg(const std::string& path) {
    const std::vector<unsigned char> bytes = readBytes(path);
    size_t lastScan = 0, lastEnd = 0;
    for (size_t i = 0; i + 1 < bytes.size(); ++i) {
        if (bytes[i] != 0xff) continue;
        if (bytes[i + 1] == 0xda) lastScan = i;
        if (bytes[i + 1] == 0xd9) lastEnd = i;
    }
    if (lastScan == 0) failIo(path, ": is a damaged JPEG: it holds no picture");
    if (lastEnd < lastScan) failIo(path, ": the file is truncated");
}

/// The first complaint: the others, often hundreds, say the same of other lines.
std::string reason(std::string message) {
    message.erase(std::min(message.find('\n'), message.size()));
    while (!message.empty() && (message.back() == '.' || message.back() == ' ')) message.pop_back();
    return message.empty() ? "no reason given" : message;
}

}  // namespace

extern "C" __attribute__((visibility("default"))) void brumeReadImage(const std::string& path,
                                                                      size_t maxPixels, StoredImage& image) {
    OIIO::attribute("limits:channels", 64);
    OIIO::attribute("limits:imagesize_MB",
                    int(std::min<size_t>(maxPixels >> 16, 1 << 20) + 1));  // 16 bytes each
    OIIO::ImageSpec wishes;
    wishes["oiio:UnassociatedAlpha"] = 1;  // as stored, not premultiplied behind our back
    const auto in = OIIO::ImageInput::open(path, &wishes);
    if (!in) {
        const std::string said = reason(OIIO::geterror());
        const bool isOfNone = said.find("could not find a format reader") != std::string::npos;
        failIo(path, isOfNone ? ": is damaged: it only begins like a JPEG, TIFF or HDR image"
                              : ": cannot be read: " + said);
    }
    const OIIO::ImageSpec spec = in->spec();
    requireSize(path, spec.width, spec.height, maxPixels);
    // Memory is taken for a whole tile, however small the image.
    if (spec.tile_width) requireSize(path, spec.tile_width, spec.tile_height, maxPixels, "each of its tiles");
    if (spec.nchannels < 1 || spec.nchannels > 4 || spec.depth != 1)
        failIo(path, ": has ", spec.nchannels, " channels, not 1 to 4");
    if (std::string(in->format_name()) == "jpeg") requireEndOfJpeg(path);
    const bool bytes = spec.format == OIIO::TypeUInt8, words = spec.format == OIIO::TypeUInt16;
    image.pixels.create(spec.height, spec.width,
                        CV_MAKETYPE(bytes   ? CV_8U
                                    : words ? CV_16U
                                            : CV_32F,
                                    spec.nchannels));
    const OIIO::TypeDesc type = bytes ? OIIO::TypeUInt8 : words ? OIIO::TypeUInt16 : OIIO::TypeFloat;
    // Where a TIFF is cut off, its pixels may come back black with nothing but a complaint left behind. Of a
    // JPEG complaints are many and harmless.
    const bool isRead = in->read_image(0, 0, 0, spec.nchannels, type, image.pixels.data);
    if (!isRead || (std::string(in->format_name()) == "tiff" && in->has_error()))
        failIo(path, ": is damaged: ", reason(in->geterror()));
    // Integers wider than 16 bits arrive as fractions of their largest value: give the numbers back.
    if (spec.format == OIIO::TypeUInt32) image.pixels *= 4294967295.;
    if (spec.format == OIIO::TypeInt32) image.pixels *= 2147483647.;
    if (spec.format == OIIO::TypeInt16) image.pixels *= 32767.;
    const std::string space = spec.get_string_attribute("oiio:ColorSpace");
    if (space == "Linear" || space == "sRGB") image.srgb = space == "sRGB";
    image.premultiplied = spec.alpha_channel >= 0 && !spec.get_int_attribute("oiio:UnassociatedAlpha");
}

extern "C" __attribute__((visibility("default"))) void brumeWriteImage(
    const std::string& path, const cv::Mat& pixels, bool srgb,
    const std::map<std::string, std::string>& attributes) {
    const OIIO::TypeDesc type = pixels.depth() == CV_8U    ? OIIO::TypeUInt8
                                : pixels.depth() == CV_16U ? OIIO::TypeUInt16
                                                           : OIIO::TypeFloat;
    OIIO::ImageSpec spec(pixels.cols, pixels.rows, pixels.channels(), type);
    spec["oiio:ColorSpace"] = srgb ? "sRGB" : "Linear";
    spec["oiio:UnassociatedAlpha"] = 1;
    spec["Compression"] = path.ends_with(".jpg") ? "jpeg:95" : "zip";
    std::string description;
    for (const auto& [name, value] : attributes)
        description += (description.empty() ? "" : "\n") + name + ": " + value;
    if (!description.empty()) spec["ImageDescription"] = description;
    // To memory first: where a disk is full, libjpeg would end the program.
    OIIO::Filesystem::IOVecOutput bytes;
    const auto out = OIIO::ImageOutput::create(path, &bytes);
    if (!out) failIo(path, ": cannot be written: ", reason(OIIO::geterror()));
    if (!out->open(path, spec) ||
        !out->write_image(type, pixels.data, OIIO::AutoStride, OIIO::stride_t(pixels.step)) || !out->close())
        failIo(path, ": cannot be written: ", reason(out->geterror()));
    writeBytes(path, {bytes.buffer()});
}

static_assert(std::is_same_v<decltype(brumeReadImage), ReadImageFunction>);
static_assert(std::is_same_v<decltype(brumeWriteImage), WriteImageFunction>);
