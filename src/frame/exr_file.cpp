#include "frame/exr_file.hpp"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfInputPart.h>
#include <ImfMultiPartInputFile.h>
#include <ImfMultiView.h>
#include <ImfPartType.h>
#include <ImfStandardAttributes.h>
#include <ImfThreading.h>
#include <openexr.h>

#include <algorithm>
#include <climits>
#include <filesystem>
#include <mutex>
#include <opencv2/core/utility.hpp>

#include "error.hpp"
#include "frame/exr_deep.hpp"
#include "frame/exr_limits.hpp"
#include "frame/exr_zip.hpp"
#include "frame/image_file.hpp"

namespace brume {

namespace {

std::string withoutPrefix(std::string message, const std::string& path) {
    const std::string prefix = "Cannot read image file \"" + path + "\". ";
    if (message.rfind(prefix, 0) == 0) message.erase(0, prefix.size());
    while (!message.empty() && (message.back() == '.' || message.back() == '\n')) message.pop_back();
    return message;
}

[[noreturn]] void failDamaged(const std::string& path, const std::string& message) {
    failIo(path, ": is a damaged EXR: ", withoutPrefix(message, path));
}

// OpenEXR's C++ reader allocates its chunk table as it opens; the C core reads headers without, so it goes
// first and holds the limits.
OpenExr openWithinLimits(const std::string& path, size_t maxPixels) {
    requireModestHeaders(path, maxPixels);
    exr_context_initializer_t setup = EXR_DEFAULT_CONTEXT_INITIALIZER;
    thread_local std::string complaint;
    complaint.clear();
    // A side's; the area is checked below, and says what is wrong with a picture of a few pixels too many.
    const int most = int(std::clamp<size_t>(maxPixels, 1 << 16, INT_MAX));
    setup.max_image_width = setup.max_image_height = setup.max_tile_width = setup.max_tile_height = most;
    setup.error_handler_fn = [](exr_const_context_t, exr_result_t, const char* message) {
        complaint = message;
    };
    exr_context_t context = nullptr;
    if (exr_start_read(&context, path.c_str(), &setup) != EXR_ERR_SUCCESS) {
        const std::string prefix = path + ": ";
        if (complaint.rfind(prefix, 0) == 0) complaint.erase(0, prefix.size());
        failDamaged(path, complaint);
    }
    OpenExr owner(context);
    const uintmax_t fileSize = std::filesystem::file_size(path);
    int parts = 0;
    exr_get_count(context, &parts);
    for (int part = 0; part < parts; ++part) {
        exr_attr_box2i_t data{}, display{};
        if (exr_get_data_window(context, part, &data) != EXR_ERR_SUCCESS ||
            exr_get_display_window(context, part, &display) != EXR_ERR_SUCCESS)
            failDamaged(path, complaint);
        for (const exr_attr_box2i_t& box : {data, display})
            requireSize(path, int64_t(box.max.x) - box.min.x + 1, int64_t(box.max.y) - box.min.y + 1,
                        maxPixels);
        requireModestBlocks(context, part, path, maxPixels);
        int32_t chunks = 0;
        if (exr_get_chunk_count(context, part, &chunks) != EXR_ERR_SUCCESS) failDamaged(path, complaint);
        if (uintmax_t(std::max(chunks, 0)) * 8 > fileSize)
            failIo(path, ": declares ", chunks, " blocks of pixels but holds only ", fileSize, " bytes");
        exr_storage_t storage{};
        exr_get_storage(context, part, &storage);
        if (storage != EXR_STORAGE_SCANLINE && storage != EXR_STORAGE_DEEP_SCANLINE) continue;
        exr_chunk_info_t place{};
        for (const int row : {data.min.y, data.max.y})
            if (exr_read_scanline_chunk_info(context, part, row, &place) != EXR_ERR_SUCCESS)
                failIo(path, ": is truncated or damaged: blocks of pixels are not where its table says");
    }
    return owner;
}

bool isDeep(const Imf::Header& header) { return header.hasType() && Imf::isDeepData(header.type()); }

void splitName(ExrChannel& channel, const std::string& partName, const std::string& partView,
               const std::vector<std::string>& views) {
    const size_t dot = channel.name.rfind('.');
    channel.base = dot == std::string::npos ? channel.name : channel.name.substr(dot + 1);
    channel.layer = dot == std::string::npos ? "" : channel.name.substr(0, dot);
    if (!partView.empty()) {
        channel.view = partView;
    } else if (!views.empty()) {
        // OpenEXR's rule: the component before the last names the view; a bare name is the first view's.
        const size_t before = channel.layer.rfind('.');
        const std::string last =
            before == std::string::npos ? channel.layer : channel.layer.substr(before + 1);
        if (channel.layer.empty()) {
            channel.view = views.front();
        } else if (std::find(views.begin(), views.end(), last) != views.end()) {
            channel.view = last;
            channel.layer = before == std::string::npos ? "" : channel.layer.substr(0, before);
        }
    }
    if (channel.layer.empty()) channel.layer = partName;
}

}  // namespace

ExrFile::ExrFile(const std::string& path, size_t maxPixels)
    : path_(path), mostSamples_(size_t(raisedBy(maxPixels) * double(1 << 26))) {
    static std::once_flag threads;
    std::call_once(threads, [] {
        if (Imf::globalThreadCount() == 0) Imf::setGlobalThreadCount(cv::getNumThreads());
    });
    core_ = openWithinLimits(path, maxPixels);
    try {
        file_ = std::make_unique<Imf::MultiPartInputFile>(
            path.c_str(), Imf::globalThreadCount(),
            false);  // no guessing where unfinished files have pixels
        for (int part = 0; part < file_->parts(); ++part) {
            if (!file_->partComplete(part)) failIo(path, ": is truncated or was never finished");
            const Imf::Header& header = file_->header(part);
            const std::string partView = header.hasView() ? header.view() : "";
            const bool many = file_->parts() > 1;
            const std::vector<std::string> views =
                Imf::hasMultiView(header) ? Imf::multiView(header) : std::vector<std::string>();
            if (part == 0) {
                const Imath::Box2i& box = header.displayWindow();
                size_ = {box.max.x - box.min.x + 1, box.max.y - box.min.y + 1};
                defaultView_ = !views.empty() ? views.front() : partView;
            }
            for (auto c = header.channels().begin(); c != header.channels().end(); ++c) {
                ExrChannel channel;
                channel.part = part;
                channel.name = c.name();
                splitName(channel, many && header.hasName() ? header.name() : "", partView, views);
                channels_.push_back(channel);
            }
        }
    } catch (const Error&) {
        throw;
    } catch (const std::exception& e) {
        failDamaged(path, e.what());
    }
}

ExrFile::~ExrFile() = default;

void CloseExr::operator()(_priv_exr_context_t* file) const { exr_finish(&file); }

const Imf::Header& ExrFile::header(int part) const { return file_->header(part); }

void ExrFile::read(const std::vector<Request>& requests) {
    for (int part = 0; part < file_->parts(); ++part) {
        std::vector<Request> here;
        for (const Request& r : requests)
            if (channels_[r.channel].part == part) here.push_back(r);
        if (here.empty()) continue;
        try {
            readPart(part, here);
        } catch (const Error&) {
            throw;
        } catch (const std::bad_alloc&) {
            throw;
        } catch (const std::exception& e) {
            failDamaged(path_, e.what());
        }
    }
}

/// Where a channel goes: its first pixel, and floats from pixel to pixel and row to row.
struct ExrFile::Target {
    float* first = nullptr;
    size_t xStride = 1, yStride = 0;
};

bool ExrFile::isZipped(int part) const {
    const Imf::Header& header = file_->header(part);
    if (header.hasType() && header.type() != Imf::SCANLINEIMAGE) return false;
    if (header.hasTileDescription()) return false;
    for (auto c = header.channels().begin(); c != header.channels().end(); ++c)
        if (c.channel().xSampling != 1 || c.channel().ySampling != 1) return false;
    return header.compression() == Imf::ZIP_COMPRESSION || header.compression() == Imf::ZIPS_COMPRESSION;
}

void ExrFile::readZipped(int part, const std::map<std::string, Target>& targets) {
    const Imf::Header& header = file_->header(part);
    const Imath::Box2i data = header.dataWindow();
    ExrRows rows;
    rows.size = {data.max.x - data.min.x + 1, data.max.y - data.min.y + 1};
    rows.rowsABlock = header.compression() == Imf::ZIP_COMPRESSION ? 16 : 1;
    for (auto c = header.channels().begin(); c != header.channels().end(); ++c) {
        const Imf::PixelType type = c.channel().type;
        ExrRows::Channel channel;
        channel.type = type == Imf::HALF    ? ExrRows::Type::Half
                       : type == Imf::FLOAT ? ExrRows::Type::Float
                                            : ExrRows::Type::Uint;
        if (const auto target = targets.find(c.name()); target != targets.end())
            channel = {channel.type, target->second.first, target->second.xStride, target->second.yStride};
        rows.channels.push_back(channel);
    }
    readZipRows(core_.get(), part, data.min.y, rows, path_);
}

void ExrFile::readDecoded(int part, const std::map<std::string, Target>& targets) {
    const Imath::Box2i data = file_->header(part).dataWindow();
    Imf::FrameBuffer buffer;
    for (const auto& [name, target] : targets)
        buffer.insert(name, Imf::Slice::Make(Imf::FLOAT, target.first, data, target.xStride * sizeof(float),
                                             target.yStride * sizeof(float)));
    Imf::InputPart in(*file_, part);
    in.setFrameBuffer(buffer);
    in.readPixels(data.min.y, data.max.y);
}

void ExrFile::readPart(int part, const std::vector<Request>& requests) {
    const Imf::Header& header = file_->header(part);
    const Imath::Box2i data = header.dataWindow(), display = header.displayWindow();
    const cv::Size dataSize(data.max.x - data.min.x + 1, data.max.y - data.min.y + 1);
    const bool whole = data.min == display.min && dataSize == size_ && !isDeep(header);
    const bool deep = isDeep(header);
    if (deep && header.type() != Imf::DEEPSCANLINE) failIo(path_, ": deep tiles are not supported");

    std::map<std::string, Target> targets;
    std::vector<std::string> names;
    std::vector<cv::Mat> planes(whole ? 0 : requests.size());
    for (size_t k = 0; k < requests.size(); ++k) {
        const Request& r = requests[k];
        const std::string& name = channels_[r.channel].name;
        const Imf::Channel& channel = header.channels()[name.c_str()];
        if (channel.xSampling != 1 || channel.ySampling != 1)
            failIo(path_, ": channel ", name, " is subsampled, which is not supported");
        names.push_back(name);
        if (deep) continue;
        if (!whole) planes[k].create(dataSize, CV_32F);
        cv::Mat& target = whole ? *r.image : planes[k];
        targets[name] = {target.ptr<float>() + (whole ? r.to : 0), size_t(target.channels()), target.step1()};
    }
    if (deep)
        planes = flattenDeep(*file_, part, names, path_, mostSamples_);
    else if (isZipped(part))
        readZipped(part, targets);
    else
        readDecoded(part, targets);
    if (whole) return;
    const cv::Rect visible =
        cv::Rect(cv::Point(data.min.x - display.min.x, data.min.y - display.min.y), dataSize) &
        cv::Rect(cv::Point(0, 0), size_);
    if (visible.empty()) failIo(path_, ": its data window lies outside its display window");
    const cv::Rect source = visible - cv::Point(data.min.x - display.min.x, data.min.y - display.min.y);
    for (size_t k = 0; k < requests.size(); ++k) {
        cv::Mat to = (*requests[k].image)(visible);
        const int fromTo[] = {0, requests[k].to};
        cv::mixChannels(planes[k](source), to, fromTo, 1);
    }
}

}  // namespace brume
