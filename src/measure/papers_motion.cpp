// How fog moves: animations of a still frame, compared frame by frame. And what is shown of it.
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "error.hpp"
#include "frame/color_encoding.hpp"
#include "frame/image_writers.hpp"
#include "measure/papers.hpp"

namespace brume {
namespace {

constexpr int shownWidth = 300, gap = 6;  // px

// CV_32FC3, 8-bit steps: what a viewer sees of a picture.
cv::Mat seen(const cv::Mat& image) {
    cv::Mat out(image.size(), CV_32FC3);
    cv::parallel_for_({0, image.rows}, [&](cv::Range rows) {
        std::vector<float> clipped(size_t(image.cols) * 4), encoded(clipped.size());
        for (int j = rows.start; j < rows.end; j++) {
            const float* in = image.ptr<float>(j);
            for (size_t k = 0; k < clipped.size(); k++) clipped[k] = in[k] < 0 ? 0 : in[k] > 1 ? 1 : in[k];
            srgbEncodeRow(clipped.data(), encoded.data(), int(clipped.size()));
            for (int i = 0; i < image.cols; i++)
                for (int c = 0; c < 3; c++) out.at<cv::Vec3f>(j, i)[c] = 255 * encoded[size_t(4 * i + c)];
        }
    });
    return out;
}

// CV_8U, 255 where nothing but fog is seen.
cv::Mat opacity(const cv::Mat& transmittance) {
    cv::Mat green, small;
    cv::extractChannel(transmittance, green, 1);
    const int height = std::max(1, int(std::lround(double(green.rows) * shownWidth / green.cols)));
    cv::resize(green, small, {shownWidth, height}, 0, 0, cv::INTER_AREA);
    cv::Mat out;
    small.convertTo(out, CV_8U, -255, 255);
    return out;
}

int liveliestRow(const std::vector<std::vector<cv::Mat>>& opacities) {
    std::vector<double> change(size_t(opacities[0][0].rows));
    for (const auto& frames : opacities)
        for (size_t k = 1; k < frames.size(); k++)
            for (int j = 0; j < frames[k].rows; j++)
                change[size_t(j)] += cv::norm(frames[k].row(j), frames[k - 1].row(j), cv::NORM_L2SQR);
    return int(std::max_element(change.begin(), change.end()) - change.begin());
}

cv::Mat stripOf(const std::vector<cv::Mat>& frames, int row) {
    const int width = frames[0].cols, height = frames[0].rows;
    cv::Mat strip(height, 4 * width + 3 * gap, CV_8U, cv::Scalar(255));
    const size_t last = frames.size() - 1;
    int left = 0;
    for (size_t k : {size_t(0), last / 2, last}) {
        frames[k].copyTo(strip({left, 0, width, height}));
        left += width + gap;
    }
    cv::Mat line(int(frames.size()), width, CV_8U);
    for (int k = 0; k < line.rows; k++) frames[size_t(k)].row(row).copyTo(line.row(k));
    cv::resize(line, strip({left, 0, width, height}), {width, height}, 0, 0, cv::INTER_LINEAR);
    return strip;
}

}  // namespace

std::vector<PaperMotion> measureMotion(const std::vector<Chain>& chains, size_t against,
                                       const FramePair& frame, Runner& runner, double seconds, int count) {
    CV_Assert(against < chains.size() && count >= 2);
    std::vector<cv::Mat> before(chains.size());
    std::vector<std::vector<cv::Mat>> opacities(chains.size());
    std::vector<double> own(chains.size()), common(chains.size());
    FramePair now = frame;
    for (int k = 0; k < count; k++) {
        now.time = frame.time + seconds * k / (count - 1);
        std::vector<cv::Mat> changes(chains.size());
        for (size_t n = 0; n < chains.size(); n++) {
            auto images = runner.run(chains[n], now, {"transmittance"}).images;
            const cv::Mat picture = seen(images["color"]);
            opacities[n].push_back(opacity(images["transmittance"]));
            if (k > 0) changes[n] = picture - before[n];
            before[n] = picture;
        }
        for (size_t n = 0; n < chains.size() && k > 0; n++) {
            own[n] += changes[n].dot(changes[n]);
            common[n] += changes[n].dot(changes[against]);
        }
    }
    const int row = liveliestRow(opacities);
    std::vector<PaperMotion> motions(chains.size());
    for (size_t n = 0; n < chains.size(); n++) {
        motions[n].change = std::sqrt(own[n] / (3. * double(before[n].total()) * (count - 1)));
        const double most = std::sqrt(own[n] * own[against]);
        motions[n].shared = most > 0 ? common[n] / most : 0;
        motions[n].strip = stripOf(opacities[n], row);
    }
    return motions;
}

cv::Mat middleOf(const cv::Mat& image) {
    const cv::Size size(std::min(image.cols, 480), std::min(image.rows, 270));
    const cv::Rect middle({(image.cols - size.width) / 2, (image.rows - size.height) / 2}, size);
    cv::Mat out;
    seen(image(middle)).convertTo(out, CV_8U);
    return out;
}

void writePictures(std::vector<PaperResult>& results, const std::string& folder) {
    int count = 0;
    for (PaperResult& r : results) {
        if (r.shown.empty()) continue;
        r.picture = text("papers.", ++count, ".png");
        writePng(folder + "/" + r.picture, r.shown, {});
    }
}

}  // namespace brume
