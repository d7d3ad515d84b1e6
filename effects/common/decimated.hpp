// Decimated blurs of RGBA float images on the CPU: a prefilter, every factor-th pixel, a small FIR, and back
// up. Edges replicate exactly. Twin of blur.glsl; both read the numbers of
// blur_design.hpp.
#pragma once

#include "common/blur_cpu.hpp"
#include "common/blur_design.hpp"

namespace blur {

/// The numbers of a decimated blur, see blur_design.hpp.
struct DecimatedBlur {
    int factor = 1;                    ///< px of the image per px of the small one
    std::span<const float> prefilter;  ///< half, before taking every factor-th pixel
    std::span<const float> small;      ///< half, on the small image
    std::span<const float> up;         ///< enlargingTaps × factor weights
};

/// Weights of an image's rows for the small image's, what lies beyond an edge added to the edge's.
class FoldedTaps {
  public:
    FoldedTaps(std::span<const float> half, int factor, int length)
        : taps_(wholeTaps(half)), factor_(factor), reach_(int(half.size()) - 1), length_(length) {
        double sum = 0;
        for (float w : taps_) upTo_.push_back(float(sum += w));
    }
    /// The blocks of rows, blockRows each, that small row j takes something of.
    int firstBlock(int j) const { return std::clamp(center(j) - reach_, 0, length_ - 1) / blockRows; }
    int lastBlock(int j) const { return std::clamp(center(j) + reach_, 0, length_ - 1) / blockRows; }
    /// Of row y for small row j.
    float weight(int j, int y) const {
        const int t = y - center(j) + reach_, last = 2 * reach_;
        if (y >= length_) return 0;
        if (length_ == 1) return upTo_[last];
        if (y == 0) return t < 0 ? 0 : upTo_[std::min(t, last)];
        if (y == length_ - 1) return t > last ? 0 : upTo_[std::min(last - t, last)];  // they are symmetric
        return t < 0 || t > last ? 0 : taps_[t];
    }
    /// Small rows that one block may add to.
    int mostAtOnce(int smallLength) const {
        int most = 1;
        for (int j = 0, end = 0; j < smallLength; j++) {
            while (end < smallLength && firstBlock(end) <= lastBlock(j)) end++;
            most = std::max(most, end - j);
        }
        return most;
    }

  private:
    int center(int j) const { return (j - smallMargin) * factor_; }
    std::vector<float> taps_, upTo_;
    int factor_, reach_, length_;
};

/// The prefiltered image's every factor-th pixel; small pixel (i, j) sits at ((i - smallMargin)·factor, ...).
/// Columns come first: each row of the image is read once and added to the few small rows that it touches; a
/// small row that has all its rows is then decimated along itself.
/// `rowOf(y, buffer)` gives row y, or writes what is wanted of it into `buffer` and gives that. Values that
/// are not finite are replaced. `scratch`, where large enough, lends its memory.
template <class RowOf>
cv::Mat decimateRows(int width, int height, int factor, std::span<const float> half, const cv::Mat& scratch,
                     RowOf rowOf) {
    const int reach = int(half.size()) - 1, quadCount = (2 * reach + 4) / 4, floats = 4 * width;
    const int smallWidth = smallLength(width, factor), smallHeight = smallLength(height, factor);
    const FoldedTaps folded(half, factor, height);
    std::vector<float> quads(16 * size_t(quadCount), 0.0f);
    for (int t = -reach; t <= reach; t++) std::fill_n(quads.begin() + 4 * (t + reach), 4, half[std::abs(t)]);
    // decimateLine writes whole groups of four pixels.
    const int padded = (smallWidth + 3) / 4 * 4;
    bool fits = scratch.isContinuous() && scratch.total() >= size_t(padded) * smallHeight;
    cv::Mat whole =
        fits ? cv::Mat(smallHeight, padded, CV_32FC4, scratch.data) : cv::Mat(smallHeight, padded, CV_32FC4);
    // A line of sums has room for replicated edges and for what decimateLine reads beyond them.
    const int before = smallMargin * factor + reach, after = padded * factor + 4 * quadCount - width;
    const int aligned = (before + 3) / 4 * 4, lineFloats = (aligned + width + after + 3) / 4 * 16,
              lineCount = folded.mostAtOnce(smallHeight);
    const int bands = std::clamp(smallHeight / 16, 1, 2 * cv::getNumThreads());

    cv::parallel_for_(cv::Range(0, bands), [&](const cv::Range& range) {
        Scratch lines(size_t(lineFloats) * lineCount), buffers(size_t(blockRows) * floats);
        std::vector<BlockSum> sums;
        auto lineOf = [&](int j) { return lines.data() + size_t(j % lineCount) * lineFloats + 4 * aligned; };
        // Adds a block of rows to small rows `from` to `end` - 1.
        auto add = [&](int block, int from, int end, bool areReplaced) {
            const float* rows[blockRows];
            const int y = blockRows * block;
            for (int k = 0; k < blockRows; k++) {
                float* buffer = buffers.data() + size_t(k) * floats;
                rows[k] = rowOf(std::min(y + k, height - 1), buffer);
                if (areReplaced) copyFinite(buffer, rows[k], floats), rows[k] = buffer;
            }
            sums.clear();
            for (int j = from; j < end; j++) {
                BlockSum sum = {lineOf(j), {}, folded.firstBlock(j) == block, 0, 0};
                for (int k = 0; k < blockRows; k++)
                    if ((sum.weights[k] = folded.weight(j, y + k)) != 0) {
                        if (sum.count == 0) sum.first = k;
                        sum.count = k + 1 - sum.first;
                    }
                if (sum.count > 0) sums.push_back(sum);
            }
            addBlocks(sums.data(), int(sums.size()), rows, floats);
        };
        auto finish = [&](int j) {
            float* line = lineOf(j);
            if (!allFinite(line, floats))
                for (int block = folded.firstBlock(j); block <= folded.lastBlock(j); block++)
                    add(block, j, j + 1, true);
            for (int i = -before; i < 0; i++) std::memcpy(line + 4 * i, line, 16);
            for (int i = width; i < width + after; i++) std::memcpy(line + 4 * i, line + floats - 4, 16);
            decimateLine(whole.ptr<float>(j), line - 4 * before, quads.data(), quadCount, factor, smallWidth);
        };
        for (int band = range.start; band < range.end; band++) {
            const int end = smallHeight * (band + 1) / bands;
            int done = smallHeight * band / bands, begun = done;
            for (int block = folded.firstBlock(done); done < end; block++) {
                while (begun < end && folded.firstBlock(begun) <= block) begun++;
                add(block, done, begun, false);
                for (; done < begun && folded.lastBlock(done) == block; done++) finish(done);
            }
        }
    });
    return whole.colRange(0, smallWidth);
}

/// What enlargeLine wants of the weights, and the three pixels that it reads beyond the last.
inline std::vector<float> phaseGroups(int factor, std::span<const float> up) {
    std::vector<float> groups(size_t(factor + 3) / 4 * 16 * enlargingTaps + 12, 0.0f);
    for (int phase = 0; phase < factor; phase++)
        for (int m = 0; m < enlargingTaps; m++)
            std::fill_n(groups.begin() + (phase / 4 * enlargingTaps + m) * 16 + phase % 4 * 4, 4,
                        up[enlargingTaps * phase + m]);
    return groups;
}

/// Floats of room that enlargeRow needs between, and for its result, to make `count` pixels.
inline size_t roomBetween(int factor, int count) { return 4 * size_t((count - 1) / factor + 16); }
inline size_t roomEnlarged(int factor, int count) { return 4 * size_t(count + factor + 16); }

/// `count` pixels of row y of the enlarged small image from column `from`, a multiple of `factor`, on.
inline void enlargeRow(const cv::Mat& small, int factor, std::span<const float> up, const float* groups,
                       int y, int from, int count, float* between, float* out) {
    const int first = from / factor + smallMargin - 2, row = y / factor + smallMargin - 2;
    const float* rows[enlargingTaps];
    for (int m = 0; m < enlargingTaps; m++) rows[m] = small.ptr<float>(row + m) + 4 * first;
    sixSum(between, rows, up.data() + enlargingTaps * (y % factor),
           4 * std::min((count - 1) / factor + enlargingTaps, small.cols - first));
    enlargeLine(out, between + 8, groups, factor, count);
}

/// `in` and `out` are CV_32FC4 of one size and do not overlap.
inline void decimatedBlur(const cv::Mat& in, cv::Mat& out, const DecimatedBlur& blur) {
    if (blur.factor == 1) return separableFir(in, out, blur.small);
    // The output is written last, so its memory can hold the small image until then.
    cv::Mat small = decimateRows(in.cols, in.rows, blur.factor, blur.prefilter, out,
                                 [&](int y, float*) { return in.ptr<float>(y); });
    Scratch memory(4 * small.total());
    cv::Mat blurred(small.size(), CV_32FC4, memory.data());
    separableFir(small, blurred, blur.small);
    const std::vector<float> groups = phaseGroups(blur.factor, blur.up);
    const bool streams = brume::isStreamed(out);
    cv::parallel_for_(
        cv::Range(0, in.rows),
        [&](const cv::Range& range) {
            Scratch between(roomBetween(blur.factor, in.cols)), line(roomEnlarged(blur.factor, in.cols));
            for (int y = range.start; y < range.end; y++) {
                enlargeRow(blurred, blur.factor, blur.up, groups.data(), y, 0, in.cols, between.data(),
                           line.data());
                brume::putRow(out.ptr<float>(y), line.data(), 4 * size_t(in.cols), streams);
            }
            if (streams) brume::streamEnd();
        },
        4 * cv::getNumThreads());
}

}  // namespace blur
