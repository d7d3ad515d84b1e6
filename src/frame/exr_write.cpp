#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfVersion.h>

#include <map>
#include <span>
#include <string_view>
#include <vector>

#include "error.hpp"
#include "frame/exr_zip.hpp"
#include "frame/image_file.hpp"
#include "frame/image_writers.hpp"

namespace brume {

namespace {

/// OpenEXR's stream over memory, for a header.
class HeaderStream : public Imf::OStream {
  public:
    HeaderStream() : Imf::OStream("header") {}
    void write(const char c[], int n) override { bytes.insert(bytes.end(), c, c + n); }
    uint64_t tellp() override { return bytes.size(); }
    void seekp(uint64_t) override {}  // only a preview image's place is asked for again
    template <class T>
    void put(T value) {
        write(reinterpret_cast<const char*>(&value), sizeof value);
    }
    std::vector<unsigned char> bytes;
};

bool usesLongNames(const Imf::Header& header) {
    for (auto attribute = header.begin(); attribute != header.end(); ++attribute)
        if (std::string_view(attribute.name()).size() > 31) return true;
    return false;
}

struct Content {
    Imf::Header& header;
    std::map<std::string, ExrRows::Channel> channels;  // a file's order is by name

    void add(const char* name, const cv::Mat& image, int component, bool asHalf) {
        header.channels().insert(name, Imf::Channel(asHalf ? Imf::HALF : Imf::FLOAT));
        channels[name] = {asHalf ? ExrRows::Type::Half : ExrRows::Type::Float,
                          const_cast<float*>(image.ptr<float>() + component), size_t(image.channels()),
                          image.step1()};
    }
};

}  // namespace

void writeExr(const std::string& path, const ExrContent& content) {
    const cv::Mat& any = !content.color.empty()  ? content.color
                         : !content.grey.empty() ? content.grey
                                                 : content.depth;
    Imf::Header header(any.cols, any.rows);
    header.compression() = Imf::ZIP_COMPRESSION;
    Content planes{header, {}};
    const char* names[] = {"R", "G", "B", "A"};
    if (!content.color.empty())
        for (int c = 0; c < (content.alpha ? 4 : 3); ++c)
            planes.add(names[c], content.color, c, content.halfColor);
    if (!content.grey.empty()) planes.add("Y", content.grey, 0, content.halfColor);
    if (!content.depth.empty()) planes.add("Z", content.depth, 0, false);
    try {
        putStatements(header, content.statements, content.folder);
        for (const auto& [name, value] : content.attributes) header.insert(name, Imf::StringAttribute(value));
        ExrRows rows;
        rows.size = any.size();
        for (const auto& [name, channel] : planes.channels) rows.channels.push_back(channel);
        const std::vector<std::vector<uint8_t>> blocks = zipRows(rows);

        HeaderStream head;
        head.put<int32_t>(Imf::MAGIC);
        head.put<int32_t>(Imf::EXR_VERSION | (usesLongNames(header) ? Imf::LONG_NAMES_FLAG : 0));
        header.writeTo(head);
        uint64_t place = head.bytes.size() + blocks.size() * sizeof(uint64_t);
        for (const auto& block : blocks) {
            head.put<uint64_t>(place);
            place += block.size();
        }
        std::vector<std::span<const unsigned char>> pieces = {head.bytes};
        pieces.insert(pieces.end(), blocks.begin(), blocks.end());
        writeBytes(path, pieces);
    } catch (const Error&) {
        throw;
    } catch (const std::exception& e) {
        failIo(path, ": cannot be written: ", e.what());
    }
}

}  // namespace brume
