// The formats that are a header and plain numbers: NumPy's .npy, PFM, Sintel's .dpt.
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>

#include "error.hpp"
#include "frame/image_file.hpp"

namespace brume {

namespace {

using Bytes = std::vector<unsigned char>;

/// Refuses a file whose pixels end before its header says.
void requireBytes(const std::string& path, const Bytes& bytes, size_t offset, uint64_t wanted) {
    if (bytes.size() < offset || bytes.size() - offset < wanted)
        failIo(path, ": the file is truncated: its header asks for ", wanted, " bytes of pixels, it holds ",
               bytes.size() - std::min(offset, bytes.size()));
}

template <class T>
T at(const unsigned char* p, bool swap) {
    unsigned char raw[sizeof(T)];
    for (size_t k = 0; k < sizeof(T); ++k) raw[k] = p[swap ? sizeof(T) - 1 - k : k];
    T value;
    std::memcpy(&value, raw, sizeof(T));
    return value;
}

template <class In, class Out>
void convert(const unsigned char* p, bool swap, cv::Mat& pixels) {
    for (int j = 0; j < pixels.rows; ++j) {
        Out* out = pixels.ptr<Out>(j);
        for (int k = 0; k < pixels.cols * pixels.channels(); ++k, p += sizeof(In))
            out[k] = Out(at<In>(p, swap));
    }
}

constexpr bool bigEndianHere = std::endian::native == std::endian::big;

}  // namespace

StoredImage loadPfm(const std::string& path, size_t maxPixels) {
    const Bytes bytes = readBytes(path);
    // Magic, width, height, scale: apart by any white space, comments allowed; then exactly one white byte.
    size_t place = 0;
    const auto word = [&] {
        while (place < bytes.size() && (std::isspace(bytes[place]) || bytes[place] == '#')) {
            if (bytes[place] == '#')
                while (place < bytes.size() && bytes[place] != '\n') ++place;
            else
                ++place;
        }
        std::string out;
        while (place < bytes.size() && !std::isspace(bytes[place]) && out.size() < 32)
            out += char(bytes[place++]);
        return out;
    };
    const auto number = [&](const char* what) {
        const std::string token = word();
        double value = 0;
        const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), value);
        if (error != std::errc() || end != token.data() + token.size() || !std::isfinite(value))
            failIo(path, ": the PFM header's ", what, " is \"", token, "\", not a number");
        return value;
    };
    const int channels = word() == "PF" ? 3 : 1;
    const double width = number("width"), height = number("height"), scale = number("scale");
    if (width != std::floor(width) || height != std::floor(height) || width < 1 || height < 1 ||
        width > 1e9 || height > 1e9 || scale == 0)
        failIo(path, ": has a senseless PFM header");
    requireSize(path, int64_t(width), int64_t(height), maxPixels);
    if (place < bytes.size() && bytes[place] == '\r' && place + 1 < bytes.size() && bytes[place + 1] == '\n')
        ++place;
    ++place;
    StoredImage image;
    image.srgb = false;
    const uint64_t rowBytes = uint64_t(width) * channels * 4;
    requireBytes(path, bytes, place, rowBytes * uint64_t(height));
    image.pixels.create(int(height), int(width), CV_32FC(channels));
    // The sign of the scale is the byte order and its size says nothing about the numbers; rows run upwards.
    const bool swap = (scale > 0) != bigEndianHere;
    for (int j = 0; j < image.pixels.rows; ++j) {
        cv::Mat row = image.pixels.row(image.pixels.rows - 1 - j);
        convert<float, float>(bytes.data() + place + rowBytes * j, swap, row);
    }
    return image;
}

StoredImage loadDpt(const std::string& path, size_t maxPixels) {
    const Bytes bytes = readBytes(path);
    requireBytes(path, bytes, 0, 12);
    const auto width = at<int32_t>(bytes.data() + 4, bigEndianHere),
               height = at<int32_t>(bytes.data() + 8, bigEndianHere);
    requireSize(path, width, height, maxPixels);
    requireBytes(path, bytes, 12, uint64_t(width) * height * 4);
    StoredImage image;
    image.srgb = false;
    image.pixels.create(height, width, CV_32F);
    convert<float, float>(bytes.data() + 12, bigEndianHere, image.pixels);
    return image;
}

namespace {

/// The value of `key` in the dictionary that heads a .npy file, as written.
std::string entry(const std::string& header, const std::string& key) {
    const size_t found = header.find("'" + key + "'");
    const size_t colon = found == std::string::npos ? found : header.find(':', found);
    if (colon == std::string::npos) return "";
    const size_t start = header.find_first_not_of(' ', colon + 1);
    if (start == std::string::npos) return "";
    const size_t end = header[start] == '(' ? header.find(')', start) : header.find_first_of(",}", start);
    return header.substr(start, end == std::string::npos ? end : end - start);
}

std::vector<int64_t> shapeOf(const std::string& path, const std::string& tuple) {
    std::vector<int64_t> shape;
    for (size_t i = 0; i < tuple.size();) {
        if (!std::isdigit(static_cast<unsigned char>(tuple[i]))) {
            ++i;
            continue;
        }
        int64_t value = 0;
        const auto [end, error] = std::from_chars(tuple.data() + i, tuple.data() + tuple.size(), value);
        if (error != std::errc()) failIo(path, ": has a senseless shape: ", tuple, ")");
        shape.push_back(value);
        i = size_t(end - tuple.data());
    }
    // (1, h, w) is (h, w), and (1, h, w, c) is (h, w, c); but (1, w, 3) is a row of colours.
    const bool hasChannels = shape.size() == 3 && shape.back() >= 1 && shape.back() <= 4;
    if (shape.size() > 2 && shape.front() == 1 && !hasChannels) shape.erase(shape.begin());
    return shape;
}

}  // namespace

StoredImage loadNpy(const std::string& path, size_t maxPixels) {
    const Bytes bytes = readBytes(path);
    requireBytes(path, bytes, 0, 12);
    const bool longHeader = bytes[6] >= 2;
    const size_t start = longHeader ? 12 : 10;
    const size_t length = longHeader ? at<uint32_t>(bytes.data() + 8, bigEndianHere)
                                     : at<uint16_t>(bytes.data() + 8, bigEndianHere);
    requireBytes(path, bytes, start, length);
    const std::string header(bytes.begin() + start, bytes.begin() + start + length);
    const std::string type = entry(header, "descr"), tuple = entry(header, "shape");
    if (entry(header, "fortran_order") != "False") failIo(path, ": Fortran order is not supported");
    const std::vector<int64_t> shape = shapeOf(path, tuple);
    const int64_t channels = shape.size() == 3 ? shape[2] : 1;
    if (shape.size() < 2 || shape.size() > 3 || channels < 1 || channels > 4)
        failIo(path, ": has the shape ", tuple, "), not (height, width) or (height, width, 1 to 4)");
    requireSize(path, shape[1], shape[0], maxPixels);

    struct Type {
        const char* name;
        int size, matDepth;
        void (*read)(const unsigned char*, bool, cv::Mat&);
    };
    static const Type types[] = {
        {"u1", 1, CV_8U, convert<uint8_t, uchar>},        {"b1", 1, CV_8U, convert<uint8_t, uchar>},
        {"u2", 2, CV_16U, convert<uint16_t, ushort>},     {"i2", 2, CV_32F, convert<int16_t, float>},
        {"u4", 4, CV_32F, convert<uint32_t, float>},      {"i4", 4, CV_32F, convert<int32_t, float>},
        {"u8", 8, CV_32F, convert<uint64_t, float>},      {"i8", 8, CV_32F, convert<int64_t, float>},
        {"f2", 2, CV_32F, convert<cv::float16_t, float>}, {"f4", 4, CV_32F, convert<float, float>},
        {"f8", 8, CV_32F, convert<double, float>},
    };
    const std::string code = type.size() == 5 ? type.substr(2, 2) : "";
    const Type* chosen = nullptr;
    for (const Type& t : types)
        if (code == t.name) chosen = &t;
    if (!chosen) failIo(path, ": has the number type ", type, ", which is not supported");
    requireBytes(path, bytes, start + length, uint64_t(shape[0]) * shape[1] * channels * chosen->size);
    StoredImage image;
    image.pixels.create(int(shape[0]), int(shape[1]), CV_MAKETYPE(chosen->matDepth, int(channels)));
    const bool big = type[1] == '>';
    chosen->read(bytes.data() + start + length, big != bigEndianHere, image.pixels);
    return image;
}

}  // namespace brume
