// PNG by zlib: bands of rows are compressed in parallel and joined into one stream.
#include <zlib.h>

#include <algorithm>
#include <opencv2/core/utility.hpp>
#include <vector>

#include "frame/image_file.hpp"
#include "frame/image_writers.hpp"

namespace brume {

namespace {

using Bytes = std::vector<unsigned char>;

void putBigEndian(Bytes& out, uint32_t value) {
    for (int shift = 24; shift >= 0; shift -= 8) out.push_back((value >> shift) & 0xff);
}

void putChunk(Bytes& out, const char* type, const unsigned char* data, size_t size) {
    putBigEndian(out, uint32_t(size));
    const size_t start = out.size();
    out.insert(out.end(), type, type + 4);
    out.insert(out.end(), data, data + size);
    putBigEndian(out, uint32_t(crc32(0, out.data() + start, uInt(size + 4))));
}

int distance(int a, int b) { return a > b ? a - b : b - a; }

// PNG's filters Sub (1), Up (2) and Paeth (4) predict a byte from its left, upper and upper left neighbours.
// Paeth serves photographs best; choosing per row costs more than it gains on dithered pictures.
void filterRow(const unsigned char* row, const unsigned char* above, int count, int pixel,
               unsigned char* out) {
    *out++ = 4;
    for (int k = 0; k < pixel; ++k) out[k] = row[k] - above[k];
    for (int k = pixel; k < count; ++k) {
        const int a = row[k - pixel], b = above[k], c = above[k - pixel];
        const int toA = distance(b, c), toB = distance(a, c), toC = distance(a + b, 2 * c);
        const int nearer = toB <= toC ? b : c;
        const int guess = toA <= toB && toA <= toC ? a : nearer;
        out[k] = row[k] - guess;
    }
}

struct Band {
    Bytes packed;
    uLong check = 0;
    size_t rawSize = 0;
};

void compress(const cv::Mat& pixels, int from, int to, Band& band) {
    const int pixel = int(pixels.elemSize()), count = pixels.cols * pixel;
    band.rawSize = size_t(to - from) * (count + 1);
    Bytes raw(band.rawSize);
    const Bytes nothing(count);
    for (int j = from; j < to; ++j)
        filterRow(pixels.ptr(j), j > 0 ? pixels.ptr(j - 1) : nothing.data(), count, pixel,
                  raw.data() + size_t(j - from) * (count + 1));
    band.check = adler32(adler32(0, nullptr, 0), raw.data(), uInt(raw.size()));
    z_stream stream{};
    // Raw deflate: the header and the sum stand once, around all bands. What dithering leaves to find is runs
    // and the bytes' own frequencies: looking for longer matches costs a third more time, and 15 % of size.
    if (deflateInit2(&stream, 1, Z_DEFLATED, -15, 9, Z_RLE) != Z_OK) throw std::bad_alloc();
    band.packed.resize(deflateBound(&stream, uLong(raw.size())) + 16);
    stream.next_in = raw.data();
    stream.avail_in = uInt(raw.size());
    stream.next_out = band.packed.data();
    stream.avail_out = uInt(band.packed.size());
    deflate(&stream, to == pixels.rows ? Z_FINISH : Z_FULL_FLUSH);
    band.packed.resize(band.packed.size() - stream.avail_out);
    deflateEnd(&stream);
}

}  // namespace

void writePng(const std::string& path, const cv::Mat& pixels, const TextAttributes& attributes) {
    const int channels = pixels.channels();
    // Bands of a fixed size, so that the file does not depend on the number of threads; long enough that
    // starting each without history costs under 1 %.
    const int rowsABand = std::max<int>(1, int((size_t(1) << 18) / (pixels.cols * pixels.elemSize() + 1)));
    std::vector<Band> bands((pixels.rows + rowsABand - 1) / rowsABand);
    cv::parallel_for_(
        cv::Range(0, int(bands.size())),
        [&](const cv::Range& range) {
            for (int b = range.start; b < range.end; ++b)
                compress(pixels, b * rowsABand, std::min(pixels.rows, (b + 1) * rowsABand), bands[b]);
        },
        double(bands.size()));

    Bytes file = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    Bytes header;
    putBigEndian(header, uint32_t(pixels.cols));
    putBigEndian(header, uint32_t(pixels.rows));
    const bool words = pixels.depth() == CV_16U;
    header.insert(header.end(), {static_cast<unsigned char>(words ? 16 : 8),
                                 static_cast<unsigned char>(channels == 1   ? 0
                                                            : channels == 3 ? 2
                                                                            : 6),
                                 0, 0, 0});
    putChunk(file, "IHDR", header.data(), header.size());
    const unsigned char perceptual = 0;
    if (!words) putChunk(file, "sRGB", &perceptual, 1);
    for (const auto& [name, value] : attributes) {
        Bytes textChunk(name.begin(), name.begin() + std::min<size_t>(name.size(), 79));
        // iTXt: UTF-8, not compressed, no language
        textChunk.insert(textChunk.end(), {0, 0, 0, 0, 0});
        textChunk.insert(textChunk.end(), value.begin(), value.end());
        putChunk(file, "iTXt", textChunk.data(), textChunk.size());
    }
    uLong check = adler32(0, nullptr, 0);
    Bytes data = {0x78, 0x5e};
    for (const Band& band : bands) {
        check = adler32_combine(check, band.check, z_off_t(band.rawSize));
        data.insert(data.end(), band.packed.begin(), band.packed.end());
        if (&band == &bands.back()) putBigEndian(data, uint32_t(check));
        putChunk(file, "IDAT", data.data(), data.size());
        data.clear();
    }
    putChunk(file, "IEND", nullptr, 0);
    writeBytes(path, {file});
}

}  // namespace brume
