// What stored numbers of unstated meaning could be, by the geometry that each reading gives.
#include <algorithm>
#include <cmath>
#include <iomanip>
#include <opencv2/core.hpp>
#include <sstream>

#include "error.hpp"
#include "frame/inspect.hpp"
#include "frame/inspect_evidence.hpp"

namespace brume {

namespace {

std::string plain(double value) {
    std::ostringstream out;
    out << std::setprecision(3) << value;
    return out.str();
}

std::vector<std::string> candidatesFor(const cv::Mat& stored) {
    double low = 0, high = 0;
    cv::Mat finite = stored;
    if (stored.depth() == CV_32F) {
        finite = stored.clone();
        for (int j = 0; j < finite.rows; ++j)
            for (int i = 0; i < finite.cols; ++i) {
                float& v = finite.at<float>(j, i);
                if (!std::isfinite(v) || v >= 1e9f) v = 0;
            }
    }
    cv::minMaxLoc(finite, &low, &high);
    if (!(high > 0)) return {};
    // Relative inverse depth says nothing of metres: its greatest number is put at 1 m.
    const std::string inverse = "inverse:scale=" + plain(1 / high) + ",unknown=0";
    if (stored.depth() == CV_32F) {
        std::vector<std::string> names = {"linear", "linear:scale_to_metres=.01",
                                          "linear:scale_to_metres=.001", inverse};
        if (low >= 0 && high <= 1)
            for (const char* device : {"opengl:near=.1,far=1000", "direct3d:near=.1,far=1000,reversed=true",
                                       "reshade:near=.1,far=1000"})
                names.push_back(device);
        return names;
    }
    return {"millimetres",
            "tum",
            "kitti",
            "linear:scale_to_metres=.01,unknown=0",
            inverse,
            "opengl:near=.1,far=1000",
            "direct3d:near=.1,far=1000,reversed=true",
            "reshade:near=.1,far=1000"};
}

/// 1 inside [low, high], falling by e for each half decade outside.
double plausible(double value, double low, double high) {
    if (!(value > 0)) return 0;
    const double outside = std::max({0., std::log10(low / value), std::log10(value / high)});
    return std::exp(-2 * outside);
}

Reading judged(const std::string& name, const Capture& capture) {
    Reading reading;
    reading.name = name;
    reading.encoding = parseDepthEncoding(name);
    if (capture.habit) reading.encoding.zeroIsSky = capture.habit->zeroIsSky;
    const FramePair frame = thinnedReading(capture, reading.encoding);
    const DepthStatistics s = depthStatistics(frame.depth);
    const Flatness flat = flatness(frame.depth);
    const GroundOrder ground = groundOrder(frame.depth);
    const double flatScore = flat.patches >= 12 ? flat.inverseShare : .5;
    const double groundScore = ground.covered > .15 ? ground.share : .5;
    // Rooms and streets; and an eye that stands on the floor, if there is one.
    const std::optional<Floor> floor = findFloor(frame);
    const double range = std::min(plausible(s.median, .7, 80), floor ? plausible(floor->height, .4, 4) : 1);
    const double spread = plausible(s.p1 > 0 ? s.p99 / s.p1 : 0, 1.7, 3000);
    const double known = 1 - s.unknown;
    reading.score = known * (.35 * flatScore + .25 * groundScore + .25 * range + .15 * spread);
    reading.evidence = text("median ", plain(s.median), " m, 1 % to 99 % ", plain(s.p1), " to ", plain(s.p99),
                            " m; flat surfaces flat in ", plain(100 * flatScore),
                            " %, ground nearer downwards in ", plain(100 * groundScore), " %",
                            floor ? text(", floor ", plain(floor->height), " m below the eye") : "");
    return reading;
}

}  // namespace

std::vector<Reading> rankReadings(const Capture& capture) {
    std::vector<Reading> readings;
    for (const std::string& name : candidatesFor(capture.stored)) readings.push_back(judged(name, capture));
    std::stable_sort(readings.begin(), readings.end(),
                     [](const Reading& a, const Reading& b) { return a.score > b.score; });
    return readings;
}

}  // namespace brume
