// fog_blur's ladder on the CPU; twin of the ladder in fog_blur.fs. Levels decimated by more than one are
// small images by now; the others live only as the few rows that a tile of the output needs, and only where
// some pixel of it lies between them.
#pragma once

#include "common/stream.hpp"
#include "fog_blur/tile_cpu.hpp"

namespace fog_blur {

/// The blurred picture; see Tile::make for `end`.
template <class End>
void ladderBlur(const Source& source, const Ladder& ladder, const Cells& cells,
                std::span<const cv::Mat> small, cv::Mat& out, bool streams, const End& end) {
    const int width = out.cols, height = out.rows, tiles = cells.columns,
              bands = std::clamp(height / 270, 1, 8);
    cv::parallel_for_(
        cv::Range(0, bands * tiles),
        [&](const cv::Range& range) {
            Tile tile(source, ladder, small);
            for (int n = range.start; n < range.end; n++) {
                const int band = n / tiles, column = n % tiles, x0 = column * tileWidth,
                          count = std::min(tileWidth, width - x0);
                tile.begin(x0, count);
                for (int cell = cells.rows * band / bands; cell < cells.rows * (band + 1) / bands; cell++) {
                    const int y = cell * madeRows;
                    tile.make(y, std::min(madeRows, height - y), height, cells.nodes[cells.at(column, cell)],
                              cells.extremes[cells.at(column, cell)], end, out, streams);
                }
            }
            if (streams) brume::streamEnd();
        },
        bands * tiles);
}

}  // namespace fog_blur
