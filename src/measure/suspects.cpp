#include "measure/suspects.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>

#include "frame/color_encoding.hpp"

namespace brume {
namespace {

constexpr int block = 16;  // px

struct Place {
    float difference = 0;
    cv::Point at;
};

// fp32 is enough to tell which pixel to look at.
void encodeRow(const cv::Mat& image, int row, std::vector<float>& encoded) {
    const float* in = image.ptr<float>(row);
    std::vector<float> clipped(size_t(image.cols) * 4);
    for (size_t k = 0; k < clipped.size(); k++)
        clipped[k] = in[k] < 0 ? 0 : in[k] > 1 ? 1 : in[k];  // NaN stays NaN
    encoded.resize(clipped.size());
    srgbEncodeRow(clipped.data(), encoded.data(), int(clipped.size()));
}

}  // namespace

std::vector<cv::Point> farthestApart(const cv::Mat& a, const cv::Mat& b, size_t count) {
    CV_Assert(a.size() == b.size() && a.type() == CV_32FC4 && b.type() == CV_32FC4);
    const int columns = (a.cols + block - 1) / block, rows = (a.rows + block - 1) / block;
    std::vector<Place> places(size_t(columns) * rows);
    cv::parallel_for_({0, rows}, [&](cv::Range range) {
        std::vector<float> ea, eb;
        for (int j = range.start * block; j < std::min(a.rows, range.end * block); j++) {
            encodeRow(a, j, ea), encodeRow(b, j, eb);
            for (int i = 0; i < a.cols; i++) {
                float most = 0;
                for (int c = 0; c < 3; c++) {
                    const float x = ea[4 * i + c], y = eb[4 * i + c];
                    if (std::isnan(x) != std::isnan(y))
                        most = HUGE_VALF;
                    else if (std::abs(x - y) > most)
                        most = std::abs(x - y);
                }
                Place& place = places[size_t(j / block) * columns + i / block];
                if (most > place.difference) place = {most, {i, j}};
            }
        }
    });
    std::erase_if(places, [](const Place& p) { return p.difference == 0; });
    std::stable_sort(places.begin(), places.end(),
                     [](const Place& p, const Place& q) { return p.difference > q.difference; });
    places.resize(std::min(places.size(), count));
    std::vector<cv::Point> points;
    for (const Place& p : places) points.push_back(p.at);
    return points;
}

}  // namespace brume
