#include "frame/exr_zip.hpp"

#include <libdeflate.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <memory>
#include <opencv2/core/hal/hal.hpp>
#include <opencv2/core/utility.hpp>

#include "error.hpp"

namespace brume {

namespace {

static_assert(std::endian::native == std::endian::little);  // as the file's numbers are

using Type = ExrRows::Type;
using Bytes = std::vector<uint8_t>;

size_t bytesOf(Type type) { return type == Type::Half ? 2 : 4; }

// What OpenEXR feeds to zlib: bytes at even places, then those at odd places, each less the one before.
void split(const uint8_t* raw, size_t count, uint8_t* out) {
    uint8_t* odd = out + count / 2;  // pixels are of two bytes or four
    for (size_t k = 0; k < count / 2; ++k) {
        out[k] = raw[2 * k];
        odd[k] = raw[2 * k + 1];
    }
    for (size_t k = count; k-- > 1;) out[k] = uint8_t(out[k] - out[k - 1] + 128);
}

void join(uint8_t* split, size_t count, uint8_t* raw) {
    uint8_t sum = split[0];
    for (size_t k = 1; k < count; ++k) split[k] = sum = uint8_t(sum + split[k] - 128);
    const uint8_t* odd = split + count / 2;
    for (size_t k = 0; k < count / 2; ++k) {
        raw[2 * k] = split[k];
        raw[2 * k + 1] = odd[k];
    }
}

constexpr float largestHalf = 65504;

struct Converter {
    std::vector<float> floats;
    std::vector<cv::float16_t> halves;

    explicit Converter(int width) : floats(width), halves(width) {}

    void unpack(const uint8_t* from, const ExrRows::Channel& channel, int width, float* to) {
        if (channel.type == Type::Half) {
            std::memcpy(static_cast<void*>(halves.data()), from, size_t(width) * 2);
            cv::hal::cvt16f32f(halves.data(), floats.data(), width);
        } else if (channel.type == Type::Float) {
            std::memcpy(floats.data(), from, size_t(width) * 4);
        } else {
            for (int i = 0; i < width; ++i) {
                uint32_t whole;
                std::memcpy(&whole, from + size_t(i) * 4, 4);
                floats[i] = float(whole);
            }
        }
        for (int i = 0; i < width; ++i) to[i * channel.xStride] = floats[i];
    }

    void pack(const float* from, const ExrRows::Channel& channel, int width, uint8_t* to) {
        for (int i = 0; i < width; ++i) floats[i] = from[i * channel.xStride];
        if (channel.type == Type::Float) {
            std::memcpy(to, floats.data(), size_t(width) * 4);
            return;
        }
        for (float& v : floats)
            v = std::isinf(v) ? v : v > largestHalf ? largestHalf : v < -largestHalf ? -largestHalf : v;
        cv::hal::cvt32f16f(floats.data(), halves.data(), width);
        std::memcpy(to, static_cast<const void*>(halves.data()), size_t(width) * 2);
    }
};

struct Decompressor {
    libdeflate_decompressor* state = libdeflate_alloc_decompressor();
    ~Decompressor() { libdeflate_free_decompressor(state); }
};

// Level 5: files a hundredth smaller than at OpenEXR's zlib level 4, in a third of its time.
struct Compressor {
    libdeflate_compressor* state = libdeflate_alloc_compressor(5);
    ~Compressor() { libdeflate_free_compressor(state); }
};

}  // namespace

size_t ExrRows::bytesARow() const {
    size_t bytes = 0;
    for (const Channel& channel : channels) bytes += bytesOf(channel.type) * size.width;
    return bytes;
}

void readZipRows(exr_const_context_t file, int part, int firstRow, const ExrRows& rows,
                 const std::string& path) {
    const size_t bytesARow = rows.bytesARow();
    std::atomic<bool> isWhole = true;
    cv::parallel_for_(cv::Range(0, rows.blocks()), [&](const cv::Range& range) {
        Decompressor decompressor;
        if (!decompressor.state) throw std::bad_alloc();
        Converter converter(rows.size.width);
        Bytes packed, unzipped, raw;
        for (int block = range.start; block < range.end && isWhole; ++block) {
            const int from = block * rows.rowsABlock, to = std::min(rows.size.height, from + rows.rowsABlock);
            const size_t count = bytesARow * (to - from);
            exr_chunk_info_t place{};
            if (exr_read_scanline_chunk_info(file, part, firstRow + from, &place) != EXR_ERR_SUCCESS ||
                place.packed_size > count) {  // a block that does not shrink is stored as it is
                isWhole = false;
                return;
            }
            packed.resize(place.packed_size);
            raw.resize(count);
            if (exr_read_chunk(file, part, &place, packed.data()) != EXR_ERR_SUCCESS) {
                isWhole = false;
                return;
            }
            if (place.packed_size < count) {
                unzipped.resize(count);
                if (libdeflate_zlib_decompress(decompressor.state, packed.data(), packed.size(),
                                               unzipped.data(), count, nullptr) != LIBDEFLATE_SUCCESS) {
                    isWhole = false;
                    return;
                }
                join(unzipped.data(), count, raw.data());
            } else {
                raw.swap(packed);
            }
            const uint8_t* at = raw.data();
            for (int j = from; j < to; ++j)
                for (const ExrRows::Channel& channel : rows.channels) {
                    if (channel.first)
                        converter.unpack(at, channel, rows.size.width, channel.first + j * channel.yStride);
                    at += bytesOf(channel.type) * rows.size.width;
                }
        }
    });
    if (!isWhole) failIo(path, ": is a damaged EXR: a block of its pixels cannot be unpacked");
}

std::vector<std::vector<uint8_t>> zipRows(const ExrRows& rows) {
    const size_t bytesARow = rows.bytesARow();
    std::vector<Bytes> blocks(rows.blocks());
    cv::parallel_for_(cv::Range(0, rows.blocks()), [&](const cv::Range& range) {
        Compressor compressor;
        if (!compressor.state) throw std::bad_alloc();
        Converter converter(rows.size.width);
        Bytes raw, ready;
        for (int block = range.start; block < range.end; ++block) {
            const int from = block * rows.rowsABlock, to = std::min(rows.size.height, from + rows.rowsABlock);
            const size_t count = bytesARow * (to - from);
            raw.resize(count);
            ready.resize(count);
            uint8_t* at = raw.data();
            for (int j = from; j < to; ++j)
                for (const ExrRows::Channel& channel : rows.channels) {
                    converter.pack(channel.first + j * channel.yStride, channel, rows.size.width, at);
                    at += bytesOf(channel.type) * rows.size.width;
                }
            split(raw.data(), count, ready.data());
            constexpr size_t head = 8;
            Bytes& out = blocks[block];
            out.resize(head + count);
            // No room for more than the raw bytes less one: what does not shrink is stored as it is.
            size_t size =
                libdeflate_zlib_compress(compressor.state, ready.data(), count, out.data() + head, count - 1);
            if (size == 0) {
                std::memcpy(out.data() + head, raw.data(), count);
                size = count;
            }
            const int32_t row = from, bytes = int32_t(size);
            std::memcpy(out.data(), &row, 4);
            std::memcpy(out.data() + 4, &bytes, 4);
            out.resize(head + size);
        }
    });
    return blocks;
}

}  // namespace brume
