// The recursive blur of RGBA images on the CPU where its kernel is short against the image: one filter that
// runs forward and then backward (Cascade), along columns and rows at once. It goes down the image in bands
// that stay in the caches, so that each pixel is read once and written once. Edges replicate exactly; what a
// band does not look at weighs less than a millionth.
#pragma once

#include <opencv2/core.hpp>
#include <span>

#include "common/filter_lines.hpp"
#include "common/stream.hpp"
#include "common/tiny_as_zero.hpp"

namespace blur {

/// Numbers of Cascade::packed.
struct CascadeNumbers {
    float scale, keep, damping, pull, slope, before, end[4], steady, steadySlope, gain;
};

/// Of sixteen floats side by side: what is left of the pixels behind, and how that changes.
struct CascadeState {
    Four value, slope;
};
static_assert(sizeof(CascadeState) == 128);

// Before the first pixel all are like it.
BRUME_INLINE CascadeState steady(const CascadeNumbers& n, Four x) {
    return {n.steady * x, n.steadySlope * x};
}
// Behind the last pixel, too, which the forward filter has read: the backward filter's state there.
BRUME_INLINE CascadeState turned(const CascadeNumbers& n, const CascadeState& s, Four x) {
    const CascadeState ahead = steady(n, x), back = steady(n, n.gain * x);
    const Four value = s.value - ahead.value, slope = s.slope - ahead.slope;
    return {back.value + (n.end[0] * value + n.end[1] * slope),
            back.slope + (n.end[2] * value + n.end[3] * slope)};
}
BRUME_INLINE void follow(const CascadeNumbers& n, CascadeState& s, Four x) {
    const Four pushed = x - n.pull * s.value;
    s.value = n.keep * s.value + s.slope;
    s.slope = n.damping * s.slope + pushed;
}
BRUME_INLINE Four advance(const CascadeNumbers& n, CascadeState& s, Four x) {
    const Four before = s.value;
    follow(n, s, x);
    return (s.value + n.slope * s.slope) + n.before * before;
}

constexpr int cascadeRows = 8;  // taken together

// Rows of `floats` floats here have room for whole vectors. `states`: two vectors for each of a row's.
BRUME_VECTORISE static void columnsBegin(CascadeState* states, const float* row, int floats, float scale,
                                         const CascadeNumbers& n) {
    for (int i = 0; i < floats; i += 16) states[i / 16] = steady(n, scale * *(const Four*)(row + i));
}
BRUME_VECTORISE static void columnsTurn(CascadeState* states, const CascadeState* forward, const float* row,
                                        int floats, const CascadeNumbers& n) {
    for (int i = 0; i < floats; i += 16)
        states[i / 16] = turned(n, forward[i / 16], n.scale * *(const Four*)(row + i));
}

// Down eight rows, whose last pixels may lack room; whether they were all finite, which states tell. What
// comes out is left out where it is not `wanted`.
template <bool wanted>
BRUME_INLINE bool columnsDown(float* const* to, const float* const* rows, const CascadeState* before,
                              CascadeState* after, int floats, const CascadeNumbers& numbers) {
    const CascadeNumbers n = numbers;
    typedef int Bits __attribute__((vector_size(64), may_alias));
    Bits largest = {};
    auto run = [&](int i, auto load) __attribute__((always_inline)) {
        CascadeState s = before[i / 16];
        for (int k = 0; k < cascadeRows; k++)
            if constexpr (wanted)
                *(Four*)(to[k] + i) = advance(n, s, n.scale * load(rows[k] + i));
            else
                follow(n, s, n.scale * load(rows[k] + i));
        for (const Four& x : {s.value, s.slope}) {
            const Bits bits = (Bits)x & 0x7fffffff;
            largest = bits > largest ? bits : largest;
        }
        after[i / 16] = s;
    };
    for (int i = 0; i < floats; i += 16)
        if (i + 16 <= floats)
            run(
                i, [](const float* at) __attribute__((always_inline)) {
                    __builtin_prefetch(at + 256);
                    return *(const Four*)at;
                });
        else
            run(
                i, [&](const float* at) __attribute__((always_inline)) {
                    Four x = {};
                    for (int c = 0; c < floats - i; c++) x[c] = at[c];
                    return x;
                });
    int most = 0;
    for (int k = 0; k < 16; k++) most = std::max(most, largest[k]);
    return most < 0x7f800000;
}
BRUME_VECTORISE static bool columnsForward(float* const* to, const float* const* rows,
                                           const CascadeState* before, CascadeState* after, int floats,
                                           const CascadeNumbers& numbers) {
    return columnsDown<true>(to, rows, before, after, floats, numbers);
}
BRUME_VECTORISE static bool columnsApproach(const float* const* rows, const CascadeState* before,
                                            CascadeState* after, int floats, const CascadeNumbers& numbers) {
    return columnsDown<false>(nullptr, rows, before, after, floats, numbers);
}
// Up eight rows of what went down, for their state alone.
BRUME_VECTORISE static void columnsPass(CascadeState* states, const float* const* rows, int floats,
                                        const CascadeNumbers& numbers) {
    const CascadeNumbers n = numbers;
    for (int i = 0; i < floats; i += 16) {
        CascadeState s = states[i / 16];
        for (int k = cascadeRows - 1; k >= 0; k--) follow(n, s, *(const Four*)(rows[k] + i));
        states[i / 16] = s;
    }
}

// Up eight rows of what went down, and along them to the right: laneCount floats a column of eight pixels.
// Gives the rows' state at their right end, for the way back.
BRUME_VECTORISE static void columnsBackward(float* lanes, CascadeState* states, CascadeState* ends,
                                            const float* const* rows, int floats,
                                            const CascadeNumbers& numbers) {
    const CascadeNumbers n = numbers;
    CascadeState along[2] = {};
    Four last[2] = {};
    for (int i = 0; i < floats; i += 16) {
        CascadeState s = states[i / 16];
        Four x[2][4];
#pragma GCC unroll 8
        for (int k = cascadeRows - 1; k >= 0; k--) {
            __builtin_prefetch(rows[k] + i + 128);
            x[k / 4][k % 4] = advance(n, s, *(const Four*)(rows[k] + i));
        }
        states[i / 16] = s;
        for (int half = 0; half < 2; half++) transpose(x[half]);
        if (i == 0)
            for (int half = 0; half < 2; half++) along[half] = steady(n, x[half][0]);
        const int count = std::min(4, (floats - i) / 4);
        if (count == 4) {
#pragma GCC unroll 4
            for (int k = 0; k < 4; k++)
                for (int half = 0; half < 2; half++)
                    *(Four*)(lanes + laneCount * (i / 4 + k) + 16 * half) =
                        advance(n, along[half], x[half][k]);
        } else {
            for (int k = 0; k < count; k++)
                for (int half = 0; half < 2; half++)
                    *(Four*)(lanes + laneCount * (i / 4 + k) + 16 * half) =
                        advance(n, along[half], x[half][k]);
        }
        for (int half = 0; half < 2; half++) last[half] = x[half][count - 1];
    }
    for (int half = 0; half < 2; half++) ends[half] = turned(n, along[half], last[half]);
}
// Back along eight rows, the first `count` of which are wanted. put(to, x) writes four pixels.
template <class Put>
BRUME_INLINE void rowsBackwardBy(float* const* out, int count, CascadeState* ends, const float* lanes,
                                 int width, const CascadeNumbers& numbers, Put put) {
    const CascadeNumbers n = numbers;
    CascadeState along[2] = {ends[0], ends[1]};
    int i = (width - 1) / 4 * 4;
    if (const int rest = width - i; rest < 4) {
        for (int half = 0; half < 2; half++)
            for (int k = rest - 1; k >= 0; k--) {
                const Four x = n.scale * advance(n, along[half],
                                                 *(const Four*)(lanes + laneCount * (i + k) + 16 * half));
                for (int row = 0; row < std::min(4, count - 4 * half); row++)
                    for (int c = 0; c < 4; c++) out[4 * half + row][4 * (i + k) + c] = x[4 * row + c];
            }
        i -= 4;
    }
    for (; i >= 0; i -= 4)
        for (int half = 0; half < 2; half++) {
            Four x[4];
            const float* at = lanes + laneCount * i + 16 * half;
#pragma GCC unroll 4
            for (int k = 3; k >= 0; k--)
                x[k] = n.scale * advance(n, along[half], *(const Four*)(at + laneCount * k));
            transpose(x);
            for (int k = 0; k < 4; k++)
                if (4 * half + k < count) put(out[4 * half + k] + 4 * i, x[k]);
        }
}
BRUME_VECTORISE static void rowsBackward(float* const* out, int count, CascadeState* ends, const float* lanes,
                                         int width, const CascadeNumbers& n) {
    rowsBackwardBy(
        out, count, ends, lanes, width, n,
        [](float* to, Four x) __attribute__((always_inline)) { *(Four*)to = x; });
}
#ifdef BRUME_STREAMS_LINES
// The same past the caches; rows begin where a line of the cache does.
BRUME_STREAMS_LINES static void rowsBackwardStreamed(float* const* out, int count, CascadeState* ends,
                                                     const float* lanes, int width, const CascadeNumbers& n) {
    rowsBackwardBy(
        out, count, ends, lanes, width, n,
        [](float* to, Four x) __attribute__((always_inline)) { brume::streamLine(to, x); });
}
#endif
/// Whether cascadedBlur takes an image of so many rows: otherwise its bands would be most of the image.
inline bool isCascaded(int height, int reach) { return reach <= std::max(128, height / 3); }

/// `in` and `out` are CV_32FC4 of one size and do not overlap; `reach` as of Cascade, `streams`:
/// CpuContext::outputIsStreamed.
inline void cascadedBlur(const cv::Mat& in, cv::Mat& out, std::span<const float> cascade, int reach,
                         bool streams) {
    CascadeNumbers numbers;
    std::memcpy(&numbers, cascade.data(), sizeof numbers);
    const int width = in.cols, height = in.rows, floats = 4 * width, room = (floats + 15) / 16 * 16;
    const int last = (height + 7) / 8 * 8, around = (reach + 7) / 8 * 8;
    // Tasks look at `reach` rows beyond theirs; always as many, so that bits do not depend on threads.
    const int tasks = height < 2 * reach ? 1 : std::clamp(height / (16 * std::max(reach, 1)) * 2, 2, 16);
    // As tall as their filtered rows stay in the last cache: what comes behind a band is gone up twice.
    constexpr size_t cacheBytes = 13 << 20;
    const int fit = int(cacheBytes / (4 * size_t(room))) - around, tallest = std::max(128, fit),
              each = last / tasks, bands = (each + tallest - 1) / tallest,
              band = (each / std::max(bands, 1) + 15) / 8 * 8, ringRows = band + around;
    const bool streamsLines = streams && brume::canStreamLines(out), isCopied = streams && !streamsLines;
    cv::parallel_for_(
        cv::Range(0, tasks),
        [&](const cv::Range& range) {
            const TinyAsZero tinyAsZero;
            Scratch ring(size_t(ringRows) * room), finite(size_t(cascadeRows) * room),
                states(6 * size_t(room)), lanes(8 * size_t(room)),
                finished(isCopied ? size_t(cascadeRows) * room : 0);
            CascadeState* forward = reinterpret_cast<CascadeState*>(states.data());
            CascadeState *after = forward + room / 16, *back = after + room / 16;
            auto slot = [&](int y) { return ring.data() + size_t(y % ringRows) * room; };
            auto copyRows = [&](int y, int count) {
                for (int k = 0; k < count; k++) {
                    float* row = finite.data() + size_t(k) * room;
                    copyFinite(row, in.ptr<float>(std::clamp(y + k, 0, height - 1)), floats);
                    std::fill(row + floats, row + room, 0.0f);
                }
                return finite.data();
            };
            auto goDown = [&](int y, bool isWanted) {
                const float* rows[cascadeRows];
                float* to[cascadeRows];
                for (int k = 0; k < cascadeRows; k++)
                    rows[k] = in.ptr<float>(std::min(y + k, height - 1)), to[k] = slot(y + k);
                auto go = [&] {
                    return isWanted ? columnsForward(to, rows, forward, after, floats, numbers)
                                    : columnsApproach(rows, forward, after, floats, numbers);
                };
                if (!go()) {
                    copyRows(y, cascadeRows);
                    for (int k = 0; k < cascadeRows; k++) rows[k] = finite.data() + size_t(k) * room;
                    go();
                }
                std::swap(forward, after);
            };
            for (int t = range.start; t < range.end; t++) {
                const int begin = last / 8 * t / tasks * 8, end = last / 8 * (t + 1) / tasks * 8;
                int done = std::max(begin - around, 0);
                columnsBegin(forward, copyRows(done, 1), floats, numbers.scale, numbers);
                for (; done < begin; done += cascadeRows) goDown(done, false);
                for (int y0 = begin; y0 < end; y0 += band) {
                    const int y1 = std::min(y0 + band, end), beyond = std::min(y1 + around, last);
                    for (; done < beyond; done += cascadeRows) goDown(done, true);
                    if (beyond == last)
                        columnsTurn(back, forward, copyRows(height - 1, 1), floats, numbers);
                    else
                        columnsBegin(back, slot(beyond - 1), floats, 1, numbers);
                    for (int y = beyond - cascadeRows; y >= y0; y -= cascadeRows) {
                        const float* rows[cascadeRows];
                        for (int k = 0; k < cascadeRows; k++) rows[k] = slot(y + k);
                        if (y >= y1) {
                            columnsPass(back, rows, floats, numbers);
                            continue;
                        }
                        CascadeState ends[2];
                        columnsBackward(lanes.data(), back, ends, rows, floats, numbers);
                        const int count = std::min(cascadeRows, height - y);
                        float* to[cascadeRows];
                        for (int k = 0; k < count; k++)
                            to[k] = isCopied ? finished.data() + size_t(k) * room : out.ptr<float>(y + k);
#ifdef BRUME_STREAMS_LINES
                        if (streamsLines) {
                            rowsBackwardStreamed(to, count, ends, lanes.data(), width, numbers);
                            continue;
                        }
#endif
                        rowsBackward(to, count, ends, lanes.data(), width, numbers);
                        for (int k = 0; k < count && isCopied; k++)
                            brume::putRow(out.ptr<float>(y + k), to[k], size_t(floats), true);
                    }
                }
            }
            if (streams) brume::streamEnd();
        },
        tasks);
}

}  // namespace blur
