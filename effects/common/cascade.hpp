// The recursive blur of RGBA images on the CPU where its kernel is short against the image: one filter that
// runs forward and then backward (Cascade), along columns and rows at once. It goes down the image in bands
// that stay in the caches, so that each pixel is read once and written once. Edges replicate exactly; what a
// band does not look at weighs less than a millionth.
#pragma once

#include <opencv2/core.hpp>
#include <span>
#include <type_traits>

#include "common/filter_lines.hpp"
#include "common/stream.hpp"
#include "common/tiny_as_zero.hpp"

namespace blur {

/// Numbers of Cascade::packed.
struct CascadeNumbers {
    float scale, keep, damping, pull, slope, before, end[4], steady, steadySlope, gain;
};

/// Of four pixels side by side: what is left of the pixels behind, and how that changes.
template <class Wide>
struct StateOf {
    typename Wide::Four value, slope;
};
constexpr int stateFloats = 32;
static_assert(sizeof(StateOf<Halves>) == 4 * stateFloats);

// Before the first pixel all are like it.
template <class Wide>
BRUME_INLINE StateOf<Wide> steady(const CascadeNumbers& n, typename Wide::Four x) {
    return {n.steady * x, n.steadySlope * x};
}
// Behind the last pixel, too, which the forward filter has read: the backward filter's state there.
template <class Wide>
BRUME_INLINE StateOf<Wide> turned(const CascadeNumbers& n, const StateOf<Wide>& s, typename Wide::Four x) {
    const StateOf<Wide> ahead = steady<Wide>(n, x), back = steady<Wide>(n, n.gain * x);
    const typename Wide::Four value = s.value - ahead.value, slope = s.slope - ahead.slope;
    return {back.value + (n.end[0] * value + n.end[1] * slope),
            back.slope + (n.end[2] * value + n.end[3] * slope)};
}
// isDelta: keep is 1 (Cascade), which no compiler may know without being told.
template <bool isDelta, class Wide>
BRUME_INLINE void follow(const CascadeNumbers& n, StateOf<Wide>& s, typename Wide::Four x) {
    const typename Wide::Four pushed = fused<Wide>(-n.pull, s.value, x);
    if constexpr (isDelta)
        s.value = s.value + s.slope;
    else
        s.value = fused<Wide>(n.keep, s.value, s.slope);
    s.slope = fused<Wide>(n.damping, s.slope, pushed);
}
template <bool isDelta, class Wide>
BRUME_INLINE typename Wide::Four advance(const CascadeNumbers& n, StateOf<Wide>& s, typename Wide::Four x) {
    const typename Wide::Four before = s.value;
    follow<isDelta>(n, s, x);
    return fused<Wide>(n.before, before, fused<Wide>(n.slope, s.slope, s.value));
}
template <class Do>
BRUME_INLINE void inEitherForm(const CascadeNumbers& n, Do run) {
    n.keep == 1.0f ? run(std::true_type()) : run(std::false_type());
}

constexpr int cascadeRows = 8;  // taken together

template <class Wide>
BRUME_INLINE StateOf<Wide> stateAt(const float* states, int i) {
    return {Wide::load(states + 2 * i), Wide::load(states + 2 * i + 16)};
}
template <class Wide>
BRUME_INLINE void putState(float* states, int i, const StateOf<Wide>& s) {
    Wide::store(states + 2 * i, s.value), Wide::store(states + 2 * i + 16, s.slope);
}

// Rows of `floats` floats here have room for whole vectors. `states`: two vectors for each of a row's.
template <class Wide>
BRUME_INLINE void columnsBeginBy(float* states, const float* row, int floats, float scale,
                                 const CascadeNumbers& n) {
    for (int i = 0; i < floats; i += 16)
        putState<Wide>(states, i, steady<Wide>(n, scale * Wide::load(row + i)));
}
BRUME_WIDE(void, columnsBegin,
           (float* states, const float* row, int floats, float scale, const CascadeNumbers& n),
           (states, row, floats, scale, n))
template <class Wide>
BRUME_INLINE void columnsTurnBy(float* states, const float* forward, const float* row, int floats,
                                const CascadeNumbers& n) {
    for (int i = 0; i < floats; i += 16)
        putState<Wide>(states, i, turned(n, stateAt<Wide>(forward, i), n.scale * Wide::load(row + i)));
}
BRUME_WIDE(void, columnsTurn,
           (float* states, const float* forward, const float* row, int floats, const CascadeNumbers& n),
           (states, forward, row, floats, n))

// Down eight rows, whose last pixels may lack room; whether they were all finite, which states tell. What
// comes out is left out where it is not wanted.
template <class Wide, bool isWanted, bool isDelta>
BRUME_INLINE bool columnsDownIn(float* const* to, const float* const* rows, const float* before, float* after,
                                int floats, const CascadeNumbers& numbers) {
    const CascadeNumbers n = numbers;
    typename Wide::Watch watch;
    auto run = [&](int i, auto load) __attribute__((always_inline)) {
        StateOf<Wide> s = stateAt<Wide>(before, i);
        for (int k = 0; k < cascadeRows; k++)
            if constexpr (isWanted)
                Wide::store(to[k] + i, advance<isDelta>(n, s, n.scale * load(rows[k] + i)));
            else
                follow<isDelta>(n, s, n.scale * load(rows[k] + i));
        watch.look(s.value), watch.look(s.slope);
        putState<Wide>(after, i, s);
    };
    for (int i = 0; i < floats; i += 16)
        if (i + 16 <= floats)
            run(
                i, [](const float* at) __attribute__((always_inline)) {
                    __builtin_prefetch(at + 96);
                    return Wide::load(at);
                });
        else
            run(
                i, [&](const float* at) __attribute__((always_inline)) {
                    float x[16] = {};
                    for (int c = 0; c < floats - i; c++) x[c] = at[c];
                    return Wide::load(x);
                });
    return watch.areFinite();
}
template <class Wide, bool isWanted>
BRUME_INLINE bool columnsDown(float* const* to, const float* const* rows, const float* before, float* after,
                              int floats, const CascadeNumbers& numbers) {
    bool areFinite = true;
    inEitherForm(
        numbers, [&](auto isDelta) __attribute__((always_inline)) {
            areFinite = columnsDownIn<Wide, isWanted, isDelta>(to, rows, before, after, floats, numbers);
        });
    return areFinite;
}
template <class Wide>
BRUME_INLINE bool columnsForwardBy(float* const* to, const float* const* rows, const float* before,
                                   float* after, int floats, const CascadeNumbers& n) {
    return columnsDown<Wide, true>(to, rows, before, after, floats, n);
}
BRUME_WIDE(bool, columnsForward,
           (float* const* to, const float* const* rows, const float* before, float* after, int floats,
            const CascadeNumbers& n),
           (to, rows, before, after, floats, n))
template <class Wide>
BRUME_INLINE bool columnsApproachBy(const float* const* rows, const float* before, float* after, int floats,
                                    const CascadeNumbers& n) {
    return columnsDown<Wide, false>(nullptr, rows, before, after, floats, n);
}
BRUME_WIDE(bool, columnsApproach,
           (const float* const* rows, const float* before, float* after, int floats, const CascadeNumbers& n),
           (rows, before, after, floats, n))
// Up eight rows of what went down, for their state alone.
template <class Wide>
BRUME_INLINE void columnsPassBy(float* states, const float* const* rows, int floats,
                                const CascadeNumbers& numbers) {
    const CascadeNumbers n = numbers;
    inEitherForm(
        n, [&](auto isDelta) __attribute__((always_inline)) {
            for (int i = 0; i < floats; i += 16) {
                auto s = stateAt<Wide>(states, i);
                for (int k = cascadeRows - 1; k >= 0; k--) follow<isDelta>(n, s, Wide::load(rows[k] + i));
                putState<Wide>(states, i, s);
            }
        });
}
BRUME_WIDE(void, columnsPass, (float* states, const float* const* rows, int floats, const CascadeNumbers& n),
           (states, rows, floats, n))

/// A step up the image by eight rows. Each four pixels' place in `lanes` passes from rows that are finished
/// to rows that come, which lie in it the other way round (`isMirrored`: from right to left).
struct CascadeStep {
    float* lanes;  // laneCount floats a column of eight pixels
    bool isMirrored;
    float* states;             // columns'
    const float* const* rows;  // what went down; null: none comes
    float* ends;               // rows' states at their right end: in, those finished; out, those that came
    float* const* out;         // rows that are finished
    int count;                 // of them
    int width;
    bool streams;  // past the caches, and then rows begin where a line of the cache does
};

// Up eight rows of what went down and along them to the right, and by turns back along those that came
// before: by itself writing the image takes as long as computing all that.
template <class Wide, bool isDelta>
BRUME_INLINE void columnsBackwardIn(const CascadeStep& step, const CascadeNumbers& numbers) {
    typedef typename Wide::Four Four;
    const CascadeNumbers n = numbers;
    const int fours = (step.width + 3) / 4, rest = step.width - 4 * (fours - 1);
    StateOf<Wide> along[2] = {}, back[2] = {stateAt<Wide>(step.ends, 0), stateAt<Wide>(step.ends, 16)};
    Four last[2] = {};
    auto finish = [&](int four, const float* from) __attribute__((always_inline)) {
        for (int half = 0; half < 2; half++) {
            Four x[4];
#pragma GCC unroll 4
            for (int k = 3; k >= 0; k--)
                x[k] = advance<isDelta>(n, back[half], Wide::load(from + laneCount * k + 16 * half));
            transpose(x);
            for (int k = 0; k < 4 && 4 * half + k < step.count; k++) {
                float* const to = step.out[4 * half + k] + 16 * four;
                step.streams ? Wide::stream(to, x[k]) : Wide::store(to, x[k]);
            }
        }
    };
    auto finishRest = [&](int four, const float* from) __attribute__((always_inline)) {
        for (int half = 0; half < 2; half++)
            for (int k = rest - 1; k >= 0; k--) {
                float x[16];
                Wide::store(x, advance<isDelta>(n, back[half], Wide::load(from + laneCount * k + 16 * half)));
                for (int row = 0; row < std::min(4, step.count - 4 * half); row++)
                    for (int c = 0; c < 4; c++)
                        step.out[4 * half + row][16 * four + 4 * k + c] = x[4 * row + c];
            }
    };
    auto come = [&](int four, float* to, int count) __attribute__((always_inline)) {
        const int i = 16 * four;
        StateOf<Wide> s = stateAt<Wide>(step.states, i);
        Four x[2][4];
#pragma GCC unroll 8
        for (int k = cascadeRows - 1; k >= 0; k--) {
            __builtin_prefetch(step.rows[k] + i + 64);
            x[k / 4][k % 4] = advance<isDelta>(n, s, Wide::load(step.rows[k] + i));
        }
        putState<Wide>(step.states, i, s);
        for (int half = 0; half < 2; half++) transpose(x[half]);
        if (four == 0)
            for (int half = 0; half < 2; half++) along[half] = steady<Wide>(n, x[half][0]);
#pragma GCC unroll 4
        for (int k = 0; k < count; k++)
            for (int half = 0; half < 2; half++)
                Wide::store(to + laneCount * k + 16 * half, advance<isDelta>(n, along[half], x[half][k]));
        for (int half = 0; half < 2; half++) last[half] = x[half][count - 1];
    };
    for (int t = 0; t < fours; t++) {
        const int other = fours - 1 - t;
        float* const place = step.lanes + 4 * laneCount * (step.isMirrored ? other : t);
        if (step.count > 0) {
            if (t > 0 || rest == 4)
                finish(other, place);
            else
                finishRest(other, place);
        }
        if (step.rows) {
            if (other > 0 || rest == 4)
                come(t, place, 4);
            else
                come(t, place, rest);
        }
    }
    for (int half = 0; half < 2 && step.rows; half++)
        putState<Wide>(step.ends, 16 * half, turned(n, along[half], last[half]));
}
template <class Wide>
BRUME_INLINE void columnsBackwardBy(const CascadeStep& step, const CascadeNumbers& n) {
    inEitherForm(
        n, [&](auto isDelta) __attribute__((always_inline)) { columnsBackwardIn<Wide, isDelta>(step, n); });
}
BRUME_WIDE(void, columnsBackward, (const CascadeStep& step, const CascadeNumbers& n), (step, n))

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
    // At a stride of whole 4 KB eight rows would fight for the same few lines of the first cache.
    const int stride = room % 1024 == 0 ? room + 144 : room;
    const bool isCopied = streams && !brume::canStreamLines(out);
    cv::parallel_for_(
        cv::Range(0, tasks),
        [&](const cv::Range& range) {
            const TinyAsZero tinyAsZero;
            Scratch ring(size_t(ringRows) * stride), finite(size_t(cascadeRows) * room),
                states(6 * size_t(room)), lanes(8 * size_t(room)),
                finished(isCopied ? size_t(cascadeRows) * room : 0);
            float *forward = states.data(), *after = forward + 2 * room, *back = after + 2 * room;
            auto slot = [&](int y) { return ring.data() + size_t(y % ringRows) * stride; };
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
            // Rows wait to be finished until those above come, or not at all where writing is quick.
            float ends[2 * stateFloats] = {};
            int waiting = 0, waitingAt = 0;
            bool isMirrored = false;
            auto goUp = [&](int y, const float* const* rows) {
                float* to[cascadeRows];
                for (int k = 0; k < waiting; k++)
                    to[k] = isCopied ? finished.data() + size_t(k) * room : out.ptr<float>(waitingAt + k);
                columnsBackward(
                    {lanes.data(), isMirrored, back, rows, ends, to, waiting, width, streams && !isCopied},
                    numbers);
                for (int k = 0; k < waiting && isCopied; k++)
                    brume::putRow(out.ptr<float>(waitingAt + k), to[k], size_t(floats), true);
                isMirrored = !isMirrored;
                waitingAt = y, waiting = rows ? std::min(cascadeRows, height - y) : 0;
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
                        goUp(y, rows);
                        if (!streams) goUp(0, nullptr);
                    }
                }
            }
            goUp(0, nullptr);
            if (streams) brume::streamEnd();
        },
        tasks);
}

}  // namespace blur
