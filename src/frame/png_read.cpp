// PNG through libpng: 8 and 16 bits, grey to RGBA, palettes expanded.
#include <png.h>

#include <bit>
#include <csetjmp>
#include <cstring>

#include "error.hpp"
#include "frame/image_file.hpp"

namespace brume {

namespace {

struct Source {
    const std::vector<unsigned char>& bytes;
    size_t at = 0;
    char error[200] = "";
};

void feed(png_structp png, png_bytep out, size_t count) {
    Source& source = *static_cast<Source*>(png_get_io_ptr(png));
    if (count > source.bytes.size() - source.at) png_error(png, "the file is truncated");
    std::memcpy(out, source.bytes.data() + source.at, count);
    source.at += count;
}

void complain(png_structp png, png_const_charp message) {
    Source& source = *static_cast<Source*>(png_get_error_ptr(png));
    std::snprintf(source.error, sizeof source.error, "%s", message);
    std::longjmp(png_jmpbuf(png), 1);
}

struct Header {
    png_uint_32 width = 0, height = 0;
    size_t packedBytes = 0;  // of the pixels, before deflate
    int bits = 0, channels = 0;
    std::optional<bool> srgb;
};

// libpng leaves by longjmp: nothing with a destructor lives in these three functions.

bool readHeader(png_structp png, png_infop info, Header& header) {
    if (setjmp(png_jmpbuf(png))) return false;
    png_read_info(png, info);
    header.width = png_get_image_width(png, info);
    header.height = png_get_image_height(png, info);
    double gamma = 0;
    if (png_get_valid(png, info, PNG_INFO_sRGB))
        header.srgb = true;
    else if (png_get_gAMA(png, info, &gamma))
        header.srgb = gamma < .9;
    header.packedBytes = png_get_rowbytes(png, info) * header.height;
    return true;
}

// Takes memory for a row.
bool prepareRows(png_structp png, png_infop info, Header& header) {
    if (setjmp(png_jmpbuf(png))) return false;
    png_set_expand(png);
    if (std::endian::native == std::endian::little) png_set_swap(png);
    png_set_interlace_handling(png);
    png_read_update_info(png, info);
    header.bits = png_get_bit_depth(png, info);
    header.channels = png_get_channels(png, info);
    return true;
}

bool readRows(png_structp png, png_bytepp rows) {
    if (setjmp(png_jmpbuf(png))) return false;
    png_read_image(png, rows);
    png_read_end(png, nullptr);
    return true;
}

struct Decoder {
    explicit Decoder(Source& source)
        : png(png_create_read_struct(PNG_LIBPNG_VER_STRING, &source, complain,
                                     [](png_structp, png_const_charp) {})),
          info(png ? png_create_info_struct(png) : nullptr) {
        if (!info) throw std::bad_alloc();
    }
    ~Decoder() { png_destroy_read_struct(&png, &info, nullptr); }
    Decoder(const Decoder&) = delete;
    png_structp png;
    png_infop info;
};

}  // namespace

StoredImage loadPng(const std::string& path, size_t maxPixels) {
    const std::vector<unsigned char> bytes = readBytes(path);
    Source source{bytes};
    Decoder decoder(source);
    const png_structp png = decoder.png;
    png_set_read_fn(png, &source, feed);
    png_set_user_limits(png, 0x7fffffff, 0x7fffffff);  // requireSize limits the area
    png_set_chunk_malloc_max(png, 1 << 24);
    png_set_keep_unknown_chunks(png, PNG_HANDLE_CHUNK_NEVER, nullptr, 0);

    Header header;
    if (!readHeader(png, decoder.info, header)) failIo(path, ": is not a readable PNG: ", source.error);
    requireSize(path, header.width, header.height, maxPixels);
    // Deflate cannot pack more than 1032 to 1.
    if (header.packedBytes / 1040 > bytes.size())
        failIo(path, ": declares ", header.width, " × ", header.height, " pixels but holds only ",
               bytes.size(), " bytes");
    if (!prepareRows(png, decoder.info, header)) failIo(path, ": is not a readable PNG: ", source.error);
    StoredImage image;
    image.srgb = header.srgb;
    image.pixels.create(int(header.height), int(header.width),
                        CV_MAKETYPE(header.bits == 16 ? CV_16U : CV_8U, header.channels));
    std::vector<png_bytep> rows(header.height);
    for (png_uint_32 j = 0; j < header.height; ++j) rows[j] = image.pixels.ptr(int(j));
    if (!readRows(png, rows.data())) failIo(path, ": is a damaged PNG: ", source.error);
    return image;
}

}  // namespace brume
