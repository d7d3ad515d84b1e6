// Deep EXR pixels, any number of samples each, flattened to colour and depth.
#include "frame/exr_deep.hpp"

#include <ImfChannelList.h>
#include <ImfDeepFrameBuffer.h>
#include <ImfDeepScanLineInputPart.h>
#include <ImfHeader.h>

#include <algorithm>
#include <filesystem>
#include <numeric>

#include "error.hpp"

namespace brume {

std::vector<cv::Mat> flattenDeep(Imf::MultiPartInputFile& file, int part,
                                 const std::vector<std::string>& names, const std::string& path,
                                 size_t mostSamples) {
    Imf::DeepScanLineInputPart in(file, part);
    const Imath::Box2i data = in.header().dataWindow();
    const int width = data.max.x - data.min.x + 1, height = data.max.y - data.min.y + 1;
    const Imf::ChannelList& channels = in.header().channels();
    const auto nameOf = [&](const char* wanted) {
        return channels.findChannel(wanted) ? std::string(wanted) : std::string();
    };
    const std::string alphaName = nameOf("A"), depthName = nameOf("Z");
    if (depthName.empty()) failIo(path, ": its deep samples have no depth Z");
    std::vector<std::string> all = names;
    for (const std::string& needed : {alphaName, depthName})
        if (!needed.empty() && std::find(all.begin(), all.end(), needed) == all.end()) all.push_back(needed);

    cv::Mat counts(height, width, CV_32S);
    const auto at = [&](auto* first) {  // OpenEXR addresses pixels by their place in the data window
        return reinterpret_cast<char*>(first - data.min.x - int64_t(data.min.y) * width);
    };
    Imf::DeepFrameBuffer buffer;
    buffer.insertSampleCountSlice(
        Imf::Slice(Imf::UINT, at(counts.ptr<unsigned>()), sizeof(unsigned), sizeof(unsigned) * width));
    std::vector<std::vector<float*>> pointers(all.size(), std::vector<float*>(size_t(width) * height));
    for (size_t c = 0; c < all.size(); ++c)
        buffer.insert(all[c], Imf::DeepSlice(Imf::FLOAT, at(pointers[c].data()), sizeof(float*),
                                             sizeof(float*) * width, sizeof(float)));
    in.setFrameBuffer(buffer);
    in.readPixelSampleCounts(data.min.y, data.max.y);
    size_t total = 0;
    for (int j = 0; j < height; ++j)
        for (int i = 0; i < width; ++i) total += size_t(std::max(counts.at<int>(j, i), 0));
    if (total > mostSamples)
        failIo(path, ": holds ", total, " deep samples, more than the limit of ", mostSamples);
    // Deflate cannot pack more than 1032 to 1, and a sample has at least two bytes.
    if (total > std::filesystem::file_size(path) * 516)
        failIo(path, ": declares ", total, " deep samples, more than the file holds");
    std::vector<std::vector<float>> samples(all.size(), std::vector<float>(total));
    size_t offset = 0;
    for (int p = 0; p < width * height; ++p) {
        for (size_t c = 0; c < all.size(); ++c) pointers[c][p] = samples[c].data() + offset;
        offset += size_t(std::max(counts.at<int>(p / width, p % width), 0));
    }
    in.readPixels(data.min.y, data.max.y);

    const size_t depthAt = std::find(all.begin(), all.end(), depthName) - all.begin();
    const size_t alphaAt =
        alphaName.empty() ? all.size() : std::find(all.begin(), all.end(), alphaName) - all.begin();
    std::vector<cv::Mat> flat;
    for (size_t c = 0; c < names.size(); ++c) flat.push_back(cv::Mat::zeros(height, width, CV_32F));
    std::vector<int> order;
    for (int p = 0; p < width * height; ++p) {
        const int count = counts.at<int>(p / width, p % width);
        order.resize(std::max(count, 0));
        std::iota(order.begin(), order.end(), 0);
        std::stable_sort(order.begin(), order.end(),
                         [&](int a, int b) { return pointers[depthAt][p][a] < pointers[depthAt][p][b]; });
        // Front to back, each sample behind what is already there. The flat depth is the first at which half
        // of the light from behind is gone, or else of the last sample that covers anything.
        float clear = 1;
        bool found = false;
        for (const int s : order) {
            const float alpha = alphaAt < all.size() ? pointers[alphaAt][p][s] : 1;
            for (size_t c = 0; c < names.size(); ++c) {
                float& out = flat[c].at<float>(p / width, p % width);
                if (c != depthAt)
                    out += clear * pointers[c][p][s];
                else if (!found && alpha > 0)
                    out = pointers[c][p][s];
            }
            clear *= 1 - std::clamp(alpha, 0.f, 1.f);
            found |= clear <= .5f;
        }
    }
    return flat;
}

}  // namespace brume
