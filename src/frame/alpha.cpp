#include "frame/alpha.hpp"

#include <opencv2/core/utility.hpp>

namespace brume {

namespace {

template <class Scale>
void scaleColor(const cv::Mat& in, cv::Mat& out, Scale scale) {
    out.create(in.size(), CV_32FC4);
    cv::parallel_for_(cv::Range(0, in.rows), [&](const cv::Range& rows) {
        for (int j = rows.start; j < rows.end; ++j) {
            const float* from = in.ptr<float>(j);
            float* to = out.ptr<float>(j);
            for (int i = 0; i < in.cols; ++i, from += 4, to += 4) {
                const float alpha = from[3];
                const bool leave = !(alpha > 0) || alpha == 1;
                for (int c = 0; c < 3; ++c) to[c] = leave ? from[c] : scale(from[c], alpha);
                to[3] = alpha;
            }
        }
    });
}

}  // namespace

void unpremultiply(cv::Mat& rgba) {
    scaleColor(rgba, rgba, [](float c, float alpha) { return c / alpha; });
}

void premultiply(const cv::Mat& rgba, cv::Mat& out) {
    scaleColor(rgba, out, [](float c, float alpha) { return c * alpha; });
}

bool isOpaque(const cv::Mat& rgba) {
    for (int j = 0; j < rgba.rows; ++j) {
        const float* p = rgba.ptr<float>(j);
        bool row = true;
        for (int i = 0; i < rgba.cols; ++i) row &= p[4 * i + 3] == 1;
        if (!row) return false;
    }
    return true;
}

}  // namespace brume
