#include "frame/decode.hpp"

#include <ImfDoubleAttribute.h>
#include <ImfHeader.h>
#include <ImfMatrixAttribute.h>
#include <ImfStringAttribute.h>

#include <atomic>
#include <opencv2/core.hpp>

#include "error.hpp"
#include "frame/alpha.hpp"
#include "frame/exr_file.hpp"
#include "frame/image_file.hpp"
#include "frame/reader_process.hpp"

namespace brume {

using nlohmann::json;

namespace {

json attributesOf(const Imf::Header& header) {
    json attributes = json::object();
    for (auto it = header.begin(); it != header.end(); ++it) {
        if (const auto* words = dynamic_cast<const Imf::StringAttribute*>(&it.attribute()))
            attributes[it.name()] = words->value();
        if (const auto* number = dynamic_cast<const Imf::DoubleAttribute*>(&it.attribute()))
            attributes[it.name()] = number->value();
        if (const auto* matrix = dynamic_cast<const Imf::M44dAttribute*>(&it.attribute())) {
            const double* first = matrix->value().getValue();
            attributes[it.name()] = std::vector<double>(first, first + 16);
        }
    }
    return attributes;
}

Decoded decodePair(const DecodeRequest& request) {
    ExrFile file(request.path, request.maxPixels);
    const ExrSelection selection = selectLayers(file);
    if (!selection.hasColor()) failIo(request.path, ": holds no colour (no channels R, G, B)");
    Decoded decoded;
    std::vector<std::string> notes;
    const bool grey = selection.color[1] < 0 && selection.color[2] < 0;
    // Pixels outside the data window are empty: alpha 0 where there is alpha.
    cv::Mat color(file.size(), CV_32FC4, cv::Scalar(0, 0, 0, selection.color[3] < 0 ? 1 : 0)), depth;
    std::vector<ExrFile::Request> channels;
    for (int c = 0; c < 4; ++c)
        if (selection.color[c] >= 0) channels.push_back({selection.color[c], &color, c});
    if (request.wantDepth && selection.depth >= 0) {
        depth = cv::Mat::zeros(file.size(), CV_32F);
        channels.push_back({selection.depth, &depth, 0});
        notes.push_back("depth: channel " + file.channels()[selection.depth].name);
    }
    file.read(channels);
    if (grey) {
        const int fromTo[] = {0, 1, 0, 2};
        cv::mixChannels(color, color, fromTo, 2);
    }
    if (!selection.view.empty()) notes.push_back("view: " + selection.view);
    if (selection.color[3] >= 0) unpremultiply(color);
    decoded.images.push_back(color);
    if (!depth.empty()) decoded.images.push_back(depth);
    decoded.facts = {{"attributes", attributesOf(file.header(0))},
                     {"notes", notes},
                     {"centimetres", selection.depthInCentimetres}};
    return decoded;
}

Decoded decodeDepth(const DecodeRequest& request) {
    ExrFile file(request.path, request.maxPixels);
    const int channel = selectDepthOnly(file);
    cv::Mat depth = cv::Mat::zeros(file.size(), CV_32F);
    file.read({{channel, &depth, 0}});
    return {{depth},
            {{"attributes", attributesOf(file.header(file.channels()[channel].part))},
             {"centimetres", selectLayers(file).depthInCentimetres}}};
}

std::atomic<bool> isHere = false;

}  // namespace

Decoded decodeHere(const DecodeRequest& request) {
    switch (request.what) {
        case Decode::Pair:
            return decodePair(request);
        case Decode::Depth:
            return decodeDepth(request);
        case Decode::Header: {
            ExrFile file(request.path, request.maxPixels);
            return {{},
                    {{"width", file.size().width},
                     {"height", file.size().height},
                     {"attributes", attributesOf(file.header(0))}}};
        }
        default: {
            const StoredImage image = loadImageHere(request.path, request.maxPixels);
            Decoded decoded{{image.pixels}, {{"premultiplied", image.premultiplied}}};
            if (image.srgb) decoded.facts["srgb"] = *image.srgb;
            return decoded;
        }
    }
}

void decodeInThisProcess() { isHere = true; }

Decoded decode(const DecodeRequest& request) { return isHere ? decodeHere(request) : decodeApart(request); }

}  // namespace brume
