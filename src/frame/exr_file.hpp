// An OpenEXR file: its parts, channels and views, read with limits on what its header may ask for.
#pragma once

#include <ImfForward.h>

#include <map>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

struct _priv_exr_context_t;

namespace brume {

/// OpenEXR's C core, open on a file for reading.
struct CloseExr {
    void operator()(_priv_exr_context_t* file) const;
};
using OpenExr = std::unique_ptr<_priv_exr_context_t, CloseExr>;

struct ExrChannel {
    int part = 0;
    std::string name;   ///< as in the file: "ViewLayer.Combined.R"
    std::string layer;  ///< "ViewLayer.Combined", "" for none; the part's name where the channel has none
    std::string view;   ///< "" where the file has no views
    std::string base;   ///< "R"
};

/// Open for reading; not thread-safe. All images have the display window's size: outside the data window they
/// are 0, alpha too.
class ExrFile {
  public:
    /// Throws Error (Io), before memory is taken for pixels.
    ExrFile(const std::string& path, size_t maxPixels);
    ~ExrFile();

    const std::string& path() const { return path_; }
    cv::Size size() const { return size_; }
    const std::vector<ExrChannel>& channels() const { return channels_; }
    const std::string& defaultView() const { return defaultView_; }
    const Imf::Header& header(int part) const;

    /// What one channel, by its place in channels(), is to fill: component `to` of `image` (CV_32FC(n), of
    /// size()).
    struct Request {
        int channel = 0;
        cv::Mat* image = nullptr;
        int to = 0;
    };
    /// Throws Error (Io): a damaged or unfinished file, subsampled channels.
    void read(const std::vector<Request>& requests);

  private:
    struct Target;
    void readPart(int part, const std::vector<Request>& requests);
    bool isZipped(int part) const;
    void readZipped(int part, const std::map<std::string, Target>& targets);
    void readDecoded(int part, const std::map<std::string, Target>& targets);

    std::string path_;
    size_t mostSamples_;  ///< of a deep part; 256 MiB a channel
    cv::Size size_;
    OpenExr core_;
    std::unique_ptr<Imf::MultiPartInputFile> file_;
    std::vector<ExrChannel> channels_;
    std::string defaultView_;
};

/// Places in ExrFile::channels(), -1 for none.
struct ExrSelection {
    int color[4] = {-1, -1, -1, -1};  ///< R, G, B, A
    int depth = -1;
    bool depthInCentimetres = false;  ///< Unreal's world depth
    std::string view;

    bool hasColor() const { return color[0] >= 0 || color[1] >= 0 || color[2] >= 0; }
};

/// The main picture and the depth of the same view, by the names that Blender, Nuke, Unreal and others write.
ExrSelection selectLayers(const ExrFile& file);

/// The channel of a file that holds only depth: Z by any name, a single channel, or the first of three.
/// Throws Error (Io) where it cannot be told.
int selectDepthOnly(const ExrFile& file);

}  // namespace brume
