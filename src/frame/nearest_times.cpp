#include "frame/nearest_times.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <queue>
#include <tuple>

namespace brume {

namespace {

// Files of one time that are not yet paired: places in a list of indices.
struct Left {
    size_t next, end;
    bool empty() const { return next == end; }
};

struct Moment {
    double time;
    Left frames, depths;
    Moment *before = nullptr, *after = nullptr;
};

// Indices in the order of their times.
std::vector<size_t> inOrder(const std::vector<double>& times) {
    std::vector<size_t> order(times.size());
    std::iota(order.begin(), order.end(), size_t(0));
    std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return times[a] < times[b]; });
    return order;
}

}  // namespace

// The closest pair that is left is one of neighbours in time, so only those are looked at: lists of strangers
// may hold a million equal times.
std::vector<int> pairNearest(const std::vector<double>& frames, const std::vector<double>& depths,
                             double mostApart) {
    const std::vector<size_t> frameAt = inOrder(frames), depthAt = inOrder(depths);
    std::vector<Moment> moments;
    for (size_t f = 0, d = 0; f < frames.size() || d < depths.size();) {
        const double time = f == frames.size()   ? depths[depthAt[d]]
                            : d == depths.size() ? frames[frameAt[f]]
                                                 : std::min(frames[frameAt[f]], depths[depthAt[d]]);
        const size_t firstFrame = f, firstDepth = d;
        while (f < frames.size() && frames[frameAt[f]] == time) ++f;
        while (d < depths.size() && depths[depthAt[d]] == time) ++d;
        moments.push_back({time, {firstFrame, f}, {firstDepth, d}});
    }
    struct Candidate {
        double apart;
        size_t frame, depth;
        Moment *ofFrame, *ofDepth;
        bool operator>(const Candidate& other) const {
            return std::tie(apart, frame, depth) > std::tie(other.apart, other.frame, other.depth);
        }
    };
    std::priority_queue<Candidate, std::vector<Candidate>, std::greater<>> candidates;
    const auto consider = [&](Moment* a, Moment* b) {
        if (!a || !b || a->frames.empty() || b->depths.empty()) return;
        const double apart = std::abs(a->time - b->time);
        if (apart <= mostApart)
            candidates.push({apart, frameAt[a->frames.next], depthAt[b->depths.next], a, b});
    };
    const auto considerBoth = [&](Moment* a, Moment* b) { consider(a, b), consider(b, a); };
    for (size_t k = 0; k < moments.size(); ++k) {
        consider(&moments[k], &moments[k]);
        if (k == 0) continue;
        moments[k].before = &moments[k - 1];
        moments[k - 1].after = &moments[k];
        considerBoth(&moments[k - 1], &moments[k]);
    }
    std::vector<int> depthOf(frames.size(), -1);
    const auto removeEmpty = [&](Moment& moment) {
        if (!moment.frames.empty() || !moment.depths.empty()) return;
        if (moment.before) moment.before->after = moment.after;
        if (moment.after) moment.after->before = moment.before;
        considerBoth(moment.before, moment.after);
    };
    while (!candidates.empty()) {
        const Candidate c = candidates.top();
        candidates.pop();
        Left &ofFrame = c.ofFrame->frames, &ofDepth = c.ofDepth->depths;
        if (ofFrame.empty() || ofDepth.empty()) continue;
        if (frameAt[ofFrame.next] == c.frame && depthAt[ofDepth.next] == c.depth) {
            depthOf[c.frame] = int(c.depth);
            ++ofFrame.next;
            ++ofDepth.next;
            removeEmpty(*c.ofFrame);
            if (c.ofDepth != c.ofFrame) removeEmpty(*c.ofDepth);
        }
        consider(c.ofFrame, c.ofDepth);
    }
    return depthOf;
}

}  // namespace brume
