// fog_blur's decimated levels on the CPU, all made in one pass over the picture.
#pragma once

#include <span>
#include <vector>

#include "common/decimated.hpp"
#include "fog_blur/cells_cpu.hpp"

namespace fog_blur {

/// Memory that small images of one picture take in turn.
class Room {
  public:
    cv::Mat take(cv::Size size) {
        memory_.emplace_back(4 * (size_t(size.area()) + blur::beyondSmall));
        return cv::Mat(size, CV_32FC4, memory_.back().data());
    }

  private:
    std::vector<blur::Scratch> memory_;
};

// One decimated level in the making.
struct SmallLevel {
    const LadderLevel* level;
    blur::SmallImage image;
    int from = 0, end = 0;     // small rows that are made
    std::vector<char> wanted;  // by cell: whether pixels that are needed take something of it
};

// The small rows that the marked cells are enlarged from, with what their FIR of `reach` takes besides; and
// which cells these are decimated from. What is added of others has no meaning.
inline void choose(SmallLevel& small, const std::vector<char>& marks, const Cells& cells, int reach,
                   int height) {
    const int factor = small.level->factor;
    auto isMarked = [&](int row) {
        auto begin = marks.begin() + ptrdiff_t(cells.at(0, row));
        return std::find(begin, begin + cells.columns, char(true)) != begin + cells.columns;
    };
    int first = 0, last = cells.rows - 1;
    while (!isMarked(first)) first++;
    while (!isMarked(last)) last--;
    const int end = std::min(cellHeight * (last + 1), height);
    small.from = std::max(0, cellHeight * first / factor + blur::smallMargin - 2 - reach);
    small.end = std::min(small.image.rows(), (end - 1) / factor + blur::smallMargin + 4 + reach);
    const int distance = (reach + 4) * factor + prefilterReach(factor);
    small.wanted =
        grown(marks, cells, (distance + cellWidth - 1) / cellWidth, (distance + cellHeight - 1) / cellHeight);
}

// One cell's rows, and what levels take of them: each is computed once, when first asked for.
class CellRows {
  public:
    using Rows = const float* const*;
    explicit CellRows(const Source& source)
        : source_(source), memory_(size_t(3) * cellHeight * 4 * cellWidth) {
        for (int kind = 0; kind < 3; kind++)
            for (int k = 0; k < cellHeight; k++)
                rows_[kind][k] = memory_.data() + size_t(kind * cellHeight + k) * 4 * cellWidth;
    }
    void begin(int x, int y, int count) {
        count_ = count, hasProduct_ = false;
        for (int k = 0; k < cellHeight; k++) {
            const int row = std::min(y + k, source_.color.rows - 1);
            const float* color = source_.color.ptr<float>(row) + 4 * x;
            ahead_.rows[k] = color + 4 * cellWidth;
            sharpen(rows_[sharp][k], color, count);
            sigmas_[k] = source_.sigma.ptr<float>(row) + x;
        }
    }
    // Share n of `of` of the cell to the right, to be asked for meanwhile.
    blur::RowsAhead ahead(size_t n, size_t of) const {
        const int from = int(cellHeight * n / of);
        blur::RowsAhead part;
        part.count = int(cellHeight * (n + 1) / of) - from;
        std::copy_n(ahead_.rows + from, part.count, part.rows);
        return part;
    }
    Rows plain() const { return rows_[sharp]; }
    // Colour and 1, times the standard deviation.
    Rows product() {
        for (int k = 0; k < cellHeight && !hasProduct_; k++)
            multiply(rows_[times][k], rows_[sharp][k], sigmas_[k], count_);
        hasProduct_ = true;
        return rows_[times];
    }
    Rows weighedFor(float sigma) {
        for (int k = 0; k < cellHeight; k++)
            weigh(rows_[weighed][k], rows_[sharp][k], sigmas_[k], sigma, count_);
        return rows_[weighed];
    }

  private:
    enum { sharp, times, weighed };
    const Source& source_;
    blur::Scratch memory_;
    float* rows_[3][cellHeight];
    const float* sigmas_[cellHeight];
    blur::RowsAhead ahead_;
    int count_ = 0;
    bool hasProduct_ = false;
};

// Adds the picture to the small images, in one pass.
inline void decimateAll(const Source& source, std::span<SmallLevel> small, const Cells& cells,
                        bool keepEdges) {
    const int width = source.color.cols, blocks = cells.rows,
              bandCount = std::clamp(blocks / 8, 1, 2 * cv::getNumThreads());
    auto work = [&](const cv::Range& range) {
        CellRows cell(source);
        std::vector<std::vector<blur::BlockSum>> sums(small.size()), scaled(small.size());
        std::vector<size_t> wanting;
        for (int n = range.start; n < range.end; n++) {
            std::vector<blur::SmallImage::Band> bands;
            int from = blocks, to = 0;
            for (auto& s : small) {
                auto rowAt = [&](int block) {
                    return std::clamp(block < blocks ? s.image.rowAt(block * cellHeight) : s.image.rows(),
                                      s.from, s.end);
                };
                bands.emplace_back(s.image, rowAt(blocks * n / bandCount),
                                   rowAt(blocks * (n + 1) / bandCount));
                if (bands.back().isDone()) continue;
                from = std::min(from, bands.back().firstBlock());
                to = std::max(to, bands.back().lastBlock() + 1);
            }
            for (int block = from; block < to; block++) {
                for (size_t l = 0; l < small.size(); l++) {
                    sums[l] = scaled[l] = bands[l].sumsOf(block);
                    for (auto& sum : scaled[l])
                        for (float& w : sum.weights) w /= small[l].level->sigma;
                }
                for (int column = 0; column < cells.columns; column++) {
                    const int x = column * cellWidth, count = std::min(cellWidth, width - x);
                    const Extremes& extremes = cells.extremes[cells.at(column, block)];
                    wanting.clear();
                    for (size_t l = 0; l < small.size(); l++)
                        if (!sums[l].empty() && small[l].wanted[cells.at(column, block)])
                            wanting.push_back(l);
                    if (wanting.empty()) continue;
                    cell.begin(x, block * cellHeight, count);
                    for (size_t n = 0; n < wanting.size(); n++) {
                        const size_t l = wanting[n];
                        const float sigma = small[l].level->sigma;
                        auto add = [&](std::vector<blur::BlockSum>& to, CellRows::Rows rows) {
                            for (auto& sum : to) sum.sum += 4 * x;
                            blur::addBlocks(to.data(), int(to.size()), rows, 4 * count,
                                            cell.ahead(n, wanting.size()));
                            for (auto& sum : to) sum.sum -= 4 * x;
                        };
                        if (!keepEdges || extremes.least >= sigma)
                            add(sums[l], cell.plain());
                        else if (extremes.most <= sigma)
                            add(scaled[l], cell.product());
                        else
                            add(sums[l], cell.weighedFor(sigma));
                    }
                }
                for (auto& band : bands) band.finish(block);
            }
        }
    };
    cv::parallel_for_(cv::Range(0, bandCount), work, bandCount);
}

/// The levels that are decimated by more than one, blurred; empty for the others, and without meaning where
/// no cell needs them.
inline std::vector<cv::Mat> smallLevels(const Source& source, std::span<const LadderLevel> levels,
                                        const Cells& cells, bool keepEdges, Room& room) {
    const int width = source.color.cols, height = source.color.rows;
    std::vector<SmallLevel> small;
    small.reserve(levels.size());
    for (size_t l = 0; l < levels.size(); l++) {
        if (levels[l].factor == 1) continue;
        std::vector<char> marks(cells.nodes.size());
        std::transform(cells.nodes.begin(), cells.nodes.end(), marks.begin(),
                       [&](const Nodes& nodes) { return nodes.has(int(l) + 1); });
        if (std::find(marks.begin(), marks.end(), char(true)) == marks.end()) continue;
        small.push_back({&levels[l], {width, height, levels[l].factor, levels[l].prefilter}});
        choose(small.back(), marks, cells, int(levels[l].taps.size()) - 1, height);
    }
    for (SmallLevel& s : small)
        s.image.setMemory(room.take(blur::SmallImage::wholeSize(width, height, s.level->factor)));
    if (!small.empty()) decimateAll(source, small, cells, keepEdges);

    std::vector<cv::Mat> blurred(levels.size());
    for (const SmallLevel& s : small) {
        cv::Mat& whole = blurred[size_t(s.level - levels.data())];
        whole = room.take(s.image.image().size());
        cv::Mat rows = whole.rowRange(s.from, s.end);
        blur::separableFir(s.image.image().rowRange(s.from, s.end), rows, s.level->taps);
    }
    return blurred;
}

}  // namespace fog_blur
