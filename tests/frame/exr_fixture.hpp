// Hand-made EXR files with any channels, parts, views and windows.
#pragma once

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>
#include <ImfStandardAttributes.h>

#include <map>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace brume::test {

struct ExrPart {
    std::map<std::string, cv::Mat> channels;  ///< CV_32F each, all of one size
    std::string name, view;
    std::vector<std::string> multiView;
    cv::Point offset;      ///< of the data window in the display window
    cv::Size displaySize;  ///< empty: the channels' size
};

inline void writeExrParts(const std::string& path, const std::vector<ExrPart>& parts) {
    std::vector<Imf::Header> headers;
    std::vector<Imf::FrameBuffer> buffers;
    for (const ExrPart& part : parts) {
        const cv::Size data = part.channels.begin()->second.size();
        const cv::Size shown = part.displaySize.empty() ? data : part.displaySize;
        const Imath::Box2i display({0, 0}, {shown.width - 1, shown.height - 1});
        const Imath::Box2i window({part.offset.x, part.offset.y},
                                  {part.offset.x + data.width - 1, part.offset.y + data.height - 1});
        Imf::Header header(display, window);
        header.compression() = Imf::ZIP_COMPRESSION;
        if (!part.name.empty()) header.setName(part.name);
        if (!part.view.empty()) header.setView(part.view);
        if (!part.multiView.empty()) Imf::addMultiView(header, part.multiView);
        if (parts.size() > 1) header.setType(Imf::SCANLINEIMAGE);
        Imf::FrameBuffer buffer;
        for (const auto& [name, pixels] : part.channels) {
            header.channels().insert(name, Imf::Channel(Imf::FLOAT));
            buffer.insert(name,
                          Imf::Slice::Make(Imf::FLOAT, pixels.data, window, sizeof(float), pixels.step));
        }
        headers.push_back(header);
        buffers.push_back(buffer);
    }
    if (parts.size() == 1) {
        Imf::OutputFile out(path.c_str(), headers[0]);
        out.setFrameBuffer(buffers[0]);
        out.writePixels(parts[0].channels.begin()->second.rows);
        return;
    }
    Imf::MultiPartOutputFile out(path.c_str(), headers.data(), int(headers.size()));
    for (size_t p = 0; p < parts.size(); ++p) {
        Imf::OutputPart part(out, int(p));
        part.setFrameBuffer(buffers[p]);
        part.writePixels(parts[p].channels.begin()->second.rows);
    }
}

/// A constant channel.
inline cv::Mat flat(float value, cv::Size size = {8, 6}) { return cv::Mat(size, CV_32F, cv::Scalar(value)); }

}  // namespace brume::test
