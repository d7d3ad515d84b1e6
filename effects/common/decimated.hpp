// Decimated blurs of RGBA float images on the CPU: a prefilter, every factor-th pixel, some blur of the small
// image, and back up. Edges replicate exactly. Twin of blur.glsl; both read the numbers of
// blur_design.hpp.
#pragma once

#include "common/blur_cpu.hpp"
#include "common/blur_design.hpp"

namespace blur {

/// The numbers of a decimated blur, see blur_design.hpp.
struct DecimatedBlur {
    int factor = 1;                    ///< px of the image per px of the small one
    std::span<const float> prefilter;  ///< half, before taking every factor-th pixel
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
class SmallImage {
  public:
    SmallImage(int width, int height, int factor, std::span<const float> half)
        : folded_(half, factor, height),
          width_(width),
          height_(height),
          factor_(factor),
          smallWidth_(smallLength(width, factor)),
          quadCount_((2 * int(half.size()) + 2) / 4),
          quads_(16 * size_t(quadCount_), 0.0f),
          rows_(smallLength(height, factor)) {
        const int reach = int(half.size()) - 1;
        for (int t = -reach; t <= reach; t++)
            std::fill_n(quads_.begin() + 4 * (t + reach), 4, half[std::abs(t)]);
        before_ = smallMargin * factor + reach;
        after_ = wholeSize(width, height, factor).width * factor + 4 * quadCount_ - width;
        aligned_ = (before_ + 3) / 4 * 4;
        lineCount_ = folded_.mostAtOnce(rows_);
    }
    /// decimateLine writes whole groups of four pixels.
    static cv::Size wholeSize(int width, int height, int factor) {
        return {(smallLength(width, factor) + 3) / 4 * 4, smallLength(height, factor)};
    }
    /// CV_32FC4 of wholeSize(), before the first Band.
    void setMemory(const cv::Mat& whole) { whole_ = whole; }
    cv::Mat image() const { return whole_.colRange(0, smallWidth_); }
    int rows() const { return rows_; }
    /// The first small row at or below row y of the image; those above the image belong to its row 0.
    int rowAt(int y) const {
        return y <= 0 ? 0 : y >= height_ ? rows() : (y + factor_ - 1) / factor_ + smallMargin;
    }

    /// Small rows `from` to `end` - 1 in the making, by one thread.
    class Band {
      public:
        Band(SmallImage& image, int from, int end)
            : image_(&image),
              done_(from),
              begun_(from),
              end_(end),
              lineFloats_((image.aligned_ + image.width_ + image.after_ + 3) / 4 * 16),
              lines_(size_t(lineFloats_) * image.lineCount_) {}
        bool isDone() const { return done_ == end_; }
        int firstBlock() const { return image_->folded_.firstBlock(done_); }
        int lastBlock() const { return image_->folded_.lastBlock(end_ - 1); }
        /// The sums that take something of rows blockRows·block and on, which come in rising order from
        /// firstBlock() on; the rows beyond the image's last are not looked at.
        const std::vector<BlockSum>& sumsOf(int block) {
            while (begun_ < end_ && image_->folded_.firstBlock(begun_) <= block) begun_++;
            return sumsOf(block, done_, begun_);
        }
        /// Finishes what has all its rows after this block, of rows that were all finite.
        void finish(int block) {
            for (; done_ < begun_ && image_->folded_.lastBlock(done_) == block; done_++)
                image_->decimate(done_, lineOf(done_));
        }
        /// The same of any rows: `again(block, sums)` adds a block again, with its values replaced that are
        /// not finite.
        template <class Again>
        void finish(int block, Again again) {
            const FoldedTaps& folded = image_->folded_;
            for (int j = done_; j < begun_ && folded.lastBlock(j) == block; j++)
                if (!allFinite(lineOf(j), 4 * image_->width_))
                    for (int b = folded.firstBlock(j); b <= block; b++) again(b, sumsOf(b, j, j + 1));
            finish(block);
        }

      private:
        float* lineOf(int j) const {
            return lines_.data() + size_t(j % image_->lineCount_) * lineFloats_ + 4 * image_->aligned_;
        }
        const std::vector<BlockSum>& sumsOf(int block, int from, int end) {
            sums_.clear();
            for (int j = from; j < end; j++) {
                BlockSum sum = {lineOf(j), {}, image_->folded_.firstBlock(j) == block, 0, 0};
                for (int k = 0; k < blockRows; k++)
                    if ((sum.weights[k] = image_->folded_.weight(j, blockRows * block + k)) != 0) {
                        if (sum.count == 0) sum.first = k;
                        sum.count = k + 1 - sum.first;
                    }
                if (sum.count > 0) sums_.push_back(sum);
            }
            return sums_;
        }
        SmallImage* image_;
        int done_, begun_, end_, lineFloats_;
        Scratch lines_;
        std::vector<BlockSum> sums_;
    };

  private:
    // A line has room for replicated edges and for what decimateLine reads beyond them.
    void decimate(int j, float* line) {
        for (int i = -before_; i < 0; i++) std::memcpy(line + 4 * i, line, 16);
        for (int i = width_; i < width_ + after_; i++) std::memcpy(line + 4 * i, line + 4 * (width_ - 1), 16);
        decimateLine(whole_.ptr<float>(j), line - 4 * before_, quads_.data(), quadCount_, factor_,
                     smallWidth_);
    }
    FoldedTaps folded_;
    int width_, height_, factor_, smallWidth_, quadCount_, before_ = 0, after_ = 0, aligned_ = 0,
                                                           lineCount_ = 0;
    std::vector<float> quads_;
    int rows_;
    cv::Mat whole_;
};

/// Of an image; values that are not finite are replaced. `scratch`, where large enough, lends its memory.
inline cv::Mat decimatedImage(const cv::Mat& in, int factor, std::span<const float> half,
                              const cv::Mat& scratch) {
    const int floats = 4 * in.cols;
    const cv::Size size = SmallImage::wholeSize(in.cols, in.rows, factor);
    const bool fits = scratch.isContinuous() && scratch.total() >= size_t(size.area());
    SmallImage small(in.cols, in.rows, factor, half);
    small.setMemory(fits ? cv::Mat(size, CV_32FC4, scratch.data) : cv::Mat(size, CV_32FC4));
    const int bands = std::clamp(small.rows() / 16, 1, 2 * cv::getNumThreads());
    cv::parallel_for_(cv::Range(0, bands), [&](const cv::Range& range) {
        const float* rows[blockRows];
        auto add = [&](int block, const std::vector<BlockSum>& sums) {
            RowsAhead ahead;
            ahead.count = blockRows;
            for (int k = 0; k < blockRows; k++) {
                rows[k] = in.ptr<float>(std::min(blockRows * block + k, in.rows - 1));
                ahead.rows[k] = rows[k] + 256;
            }
            addBlocks(sums.data(), int(sums.size()), rows, floats, ahead);
        };
        auto again = [&](int block, const std::vector<BlockSum>& sums) {
            Scratch finite(size_t(blockRows) * floats);
            for (int k = 0; k < blockRows; k++) {
                float* row = finite.data() + size_t(k) * floats;
                copyFinite(row, in.ptr<float>(std::min(blockRows * block + k, in.rows - 1)), floats);
                rows[k] = row;
            }
            addBlocks(sums.data(), int(sums.size()), rows, floats, {});
        };
        for (int n = range.start; n < range.end; n++) {
            SmallImage::Band band(small, small.rows() * n / bands, small.rows() * (n + 1) / bands);
            for (int block = band.firstBlock(), last = band.lastBlock(); block <= last; block++) {
                add(block, band.sumsOf(block));
                band.finish(block, again);
            }
        }
    });
    return small.image();
}

/// What enlargeRows wants of the weights; `taps` of enlargingTaps, the outer ones of which are 0.
inline Scratch phaseGroups(int factor, std::span<const float> up, int taps = enlargingTaps) {
    const size_t size = size_t(factor + 3) / 4 * 16 * size_t(taps);
    Scratch groups(size);
    std::fill_n(groups.data(), size, 0.0f);
    for (int phase = 0; phase < factor; phase++)
        for (int m = 0; m < taps; m++)
            std::fill_n(groups.data() + (phase / 4 * taps + m) * 16 + phase % 4 * 4, 4,
                        up[enlargingTaps * phase + (enlargingTaps - taps) / 2 + m]);
    return groups;
}

/// Floats of room for `count` pixels of enlargeRow.
inline size_t roomEnlarged(int factor, int count) { return 4 * size_t(count + factor + 16); }

/// Small images that are enlarged have room to be read beyond their last pixel, see enlargeRows.
constexpr int beyondSmall = 12;

/// `count` pixels of row y of the enlarged small image from column `from`, a multiple of `factor`, on.
template <int taps = enlargingTaps>
void enlargeRow(const cv::Mat& small, int factor, std::span<const float> up, const float* groups, int y,
                int from, int count, float* out) {
    constexpr int outer = (enlargingTaps - taps) / 2;
    const int first = from / factor + smallMargin - 2 + outer, row = y / factor + smallMargin - 2 + outer;
    const float *rows[taps], *weights = up.data() + enlargingTaps * (y % factor) + outer;
    for (int m = 0; m < taps; m++) rows[m] = small.ptr<float>(row + m) + 4 * first;
    if constexpr (taps == enlargingTaps)
        enlargeRows(out, rows, weights, groups, factor, count);
    else
        enlargeRowsByFour(out, rows, weights, groups, factor, count);
}

/// Whether four boxes made the weights, whose kernel ends at 2·factor - 2 px: the last phase's tap one
/// further on, at small pixel -1, is 0. (Six boxes of 2 px have four taps a phase too, but not those.)
inline bool isOfFourBoxes(int factor, std::span<const float> up) {
    return up[size_t(enlargingTaps) * size_t(factor - 1) + 1] == 0;
}
template <int taps>
void enlargedImage(const cv::Mat& small, cv::Mat& out, int factor, std::span<const float> up, bool streams) {
    const Scratch groups = phaseGroups(factor, up, taps);
    cv::parallel_for_(
        cv::Range(0, out.rows),
        [&](const cv::Range& range) {
            Scratch line(roomEnlarged(factor, out.cols));
            for (int y = range.start; y < range.end; y++) {
                enlargeRow<taps>(small, factor, up, groups.data(), y, 0, out.cols, line.data());
                brume::putRow(out.ptr<float>(y), line.data(), 4 * size_t(out.cols), streams);
            }
            if (streams) brume::streamEnd();
        },
        4 * cv::getNumThreads());
}

/// `in` and `out` are CV_32FC4 of one size and do not overlap; `blurSmall(from, to, streams)` is what happens
/// between the ways down and up.
template <class BlurSmall>
void decimatedBlur(const cv::Mat& in, cv::Mat& out, const DecimatedBlur& blur, bool streams,
                   BlurSmall blurSmall) {
    if (blur.factor == 1) return blurSmall(in, out, streams);
    // The output is written last, so its memory can hold the small image until then.
    cv::Mat small = decimatedImage(in, blur.factor, blur.prefilter, out);
    Scratch memory(4 * (small.total() + beyondSmall));
    cv::Mat blurred(small.size(), CV_32FC4, memory.data());
    blurSmall(small, blurred, false);
    if (isOfFourBoxes(blur.factor, blur.up))
        enlargedImage<4>(blurred, out, blur.factor, blur.up, streams);
    else
        enlargedImage<enlargingTaps>(blurred, out, blur.factor, blur.up, streams);
}

}  // namespace blur
