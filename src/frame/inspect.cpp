#include "frame/inspect.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <sstream>

#include "error.hpp"
#include "file_status.hpp"
#include "frame/inspect_evidence.hpp"

namespace brume {

namespace {

namespace fs = std::filesystem;
using Kind = DepthEncoding::Kind;

std::string shown(double value) {
    std::ostringstream out;
    out << std::setprecision(3) << value;
    return out.str();
}

std::string percent(double share) { return shown(std::round(share * 1000) / 10) + " %"; }

bool isDevice(const DepthEncoding& e) { return e.kind == Kind::Device || e.kind == Kind::Reshade; }

struct Case {
    const Capture& capture;
    const DepthEncoding& encoding;
    DepthStatistics statistics;
    FramePair thin;
    EdgeFit edges;
    Flatness flat;
    GroundOrder ground;
    std::optional<Floor> floor;
    std::vector<Doubt>& doubts;

    void doubt(const char* name, const std::string& evidence) { doubts.push_back({name, evidence}); }
};

void doubtOrientation(Case& c) {
    if (double(c.edges.edges) < .001 * double(c.thin.depth.total())) return;
    const double best = std::max({c.edges.mirrored, c.edges.flipped, c.edges.both});
    if (best < .58 || best < c.edges.asIs + .06) return;
    const std::string evidence = "depth edges meet colour edges at " + shown(c.edges.asIs) +
                                 " as captured, mirrored at " + shown(c.edges.mirrored) + ", flipped at " +
                                 shown(c.edges.flipped) + ", both at " + shown(c.edges.both) +
                                 " (.5 is chance)";
    if (best == c.edges.mirrored || best == c.edges.both) c.doubt("mirrored", evidence);
    if (best == c.edges.flipped || best == c.edges.both) c.doubt("flipped", evidence);
}

bool has(const Case& c, const char* name) {
    return std::any_of(c.doubts.begin(), c.doubts.end(), [&](const Doubt& d) { return d.name == name; });
}

// Beyond its ends a depth buffer holds nothing: such numbers are another range's, or metres.
void doubtRange(Case& c) {
    if (!isDevice(c.encoding)) return;
    const std::array<double, 2> range = storedRange(c.encoding, c.capture.stored.depth());
    const double low = std::min(range[0], range[1]), high = std::max(range[0], range[1]);
    const double slack = 1e-3 * (high - low);
    cv::Mat stored;
    c.capture.stored.convertTo(stored, CV_64F);
    size_t known = 0, outside = 0;
    double least = DepthEncoding::infinity, greatest = -DepthEncoding::infinity;
    for (int j = 0; j < stored.rows; ++j)
        for (int i = 0; i < stored.cols; ++i) {
            const double v = stored.at<double>(j, i);
            const std::vector<double>& unknown = c.encoding.unknown;
            if (!std::isfinite(v) || std::find(unknown.begin(), unknown.end(), v) != unknown.end()) continue;
            known++;
            outside += v < low - slack || v > high + slack;
            least = std::min(least, v);
            greatest = std::max(greatest, v);
        }
    if (double(outside) <= .01 * double(known)) return;
    c.doubt("range", percent(double(outside) / double(known)) + " of the stored numbers, " + shown(least) +
                         " to " + shown(greatest) + ", lie outside " + shown(low) + " to " + shown(high) +
                         ", where a depth buffer's lie: say which stand for 0 and 1, as in "
                         "range=0,range=65535, or are they distances?");
}

void doubtPolarity(Case& c) {
    if (has(c, "range")) return;
    if (isDevice(c.encoding)) {
        const double near = c.encoding.nearPlane * c.encoding.metresPerUnit;
        if (c.statistics.median > 0 && c.statistics.median < 2 * near)
            c.doubt("polarity", "half the surfaces lie within twice the near plane (median " +
                                    shown(c.statistics.median) + " m, near " + shown(near) +
                                    " m), where a depth buffer puts hardly anything: it is reversed");
        return;
    }
    if (c.flat.patches >= 12 && c.flat.inverseShare < .35)
        c.doubt("disparity",
                "on " + percent(1 - c.flat.inverseShare) + " of " + std::to_string(c.flat.patches) +
                    " sloping flat patches the distances themselves, not their inverses, run evenly "
                    "across the image: these numbers are disparities or a depth buffer");
    if (has(c, "flipped")) return;
    if (c.ground.covered > .15 && c.ground.share < .3)
        c.doubt("polarity", "in the lower half depth grows downwards in " + percent(1 - c.ground.share) +
                                " of " + std::to_string(c.ground.pairs) +
                                " places, where a floor comes nearer");
}

void doubtFarPlane(Case& c) {
    if (!isDevice(c.encoding) || has(c, "range") || has(c, "polarity") || has(c, "flipped")) return;
    const double far = c.encoding.farPlane * c.encoding.metresPerUnit;
    const double ratio = c.encoding.farPlane / c.encoding.nearPlane;
    if (std::isfinite(far) && (far < 2 || far > 1e6 || ratio > 1e8)) {
        c.doubt("far plane", "it is stated at " + shown(far) + " m, " + shown(ratio) + " × the near plane");
        return;
    }
    size_t crowd = 0, finite = 0;
    for (int j = 0; j < c.thin.depth.rows; ++j)
        for (int i = 0; i < c.thin.depth.cols; ++i) {
            const float z = c.thin.depth.at<float>(j, i);
            finite += std::isfinite(z);
            crowd += std::isfinite(z) && z > .9 * far;
        }
    if (std::isfinite(far) && double(crowd) > .1 * double(finite)) {
        c.doubt("far plane", percent(double(crowd) / double(finite)) +
                                 " of the surfaces crowd in the last tenth before " + shown(far) +
                                 " m: the true far plane lies further out");
        return;
    }
    if (!c.floor || !c.capture.poseIsStated) return;
    // A slope is not the floor: the height below the eye, which a wrong far plane leaves alone, must be
    // right.
    const double eye = c.thin.camera.eye()[1];
    if (std::abs(c.floor->height - eye) > .25 * eye) return;
    // 1/Z = s/h + offset; a level floor has none. 3.4° of unstated pitch would give .06.
    const double tilt = c.floor->offset * c.floor->height;
    if (std::abs(tilt) > .06)
        c.doubt("far plane",
                "the floor (" + percent(c.floor->share) + " of the lower half) reaches the horizon at " +
                    shown(1 / std::abs(c.floor->offset)) + " m " +
                    (tilt > 0 ? "instead of running on: the true far plane lies further out"
                              : "too early: the true far plane lies nearer") +
                    " (or the camera is pitched by " + shown(std::atan(std::abs(tilt)) * 180 / CV_PI) + "°)");
}

// The ready-made names of sensors that could have measured what `read` gives, by their reach: "tum (1.5 to
// 7.3 m)".
std::string sensorsFor(const DepthEncoding& read, const DepthStatistics& s) {
    std::string names;
    for (const std::string& name : sensorEncodingNames()) {
        const DepthEncoding e = parseDepthEncoding(name);
        const double ratio = e.scaleToMetres / read.scaleToMetres;
        if (s.p99 * ratio <= e.sensorReach)
            names += (names.empty() ? "" : ", ") + name + " (" + shown(s.p1 * ratio) + " to " +
                     shown(s.p99 * ratio) + " m)";
    }
    return names;
}

// The lists of a TUM sequence, beside the depth's folder.
bool isOfTum(const std::string& depthPath) {
    const fs::path sequence = fs::absolute(depthPath).parent_path().parent_path();
    return (isThere(sequence / "rgb.txt") && isThere(sequence / "depth.txt")) ||
           isThere(sequence / "associations.txt");
}

void doubtScale(Case& c) {
    const DepthStatistics& s = c.statistics;
    if (has(c, "range")) return;
    const double ofTum = parseDepthEncoding("tum").scaleToMetres / c.encoding.scaleToMetres;
    if (c.encoding.kind == Kind::Linear && std::abs(ofTum - 1) > .01 && c.capture.stored.type() == CV_16U &&
        isOfTum(c.capture.depthPath))
        c.doubt("scale",
                "rgb.txt and depth.txt, or associations.txt, lie beside its folder as in a TUM sequence, "
                "whose depth is 5000 a metre: is it " +
                    shown(s.p1 * ofTum) + " to " + shown(s.p99 * ofTum) +
                    " m (--depth-encoding tum) instead of " + shown(s.p1) + " to " + shown(s.p99) + " m?");
    else if (s.p99 > c.encoding.sensorReach) {
        const std::string others = sensorsFor(c.encoding, s);
        c.doubt("scale",
                "1 % lies beyond " + shown(s.p99) + " m, and such a sensor measures no farther than " +
                    shown(c.encoding.sensorReach) + " m" +
                    (others.empty() ? "" : ": are these numbers of another's unit, " + others + "?"));
    } else if (s.p1 > 100)
        c.doubt("scale", "nothing is nearer than " + shown(s.p1) + " m: are these millimetres (scale .001: " +
                             shown(s.p1 * .001) + " to " + shown(s.p99 * .001) + " m) or centimetres?");
    else if (s.p99 > 0 && s.p99 < .25)
        c.doubt("scale", "nothing is further than " + shown(s.p99) + " m: were these metres already (to " +
                             shown(s.p99 / std::min(c.encoding.scaleToMetres, 1.)) + ")?");
    else if (c.floor && c.capture.poseIsStated && !has(c, "polarity") && !has(c, "flipped") &&
             !has(c, "far plane")) {
        const double eye = c.thin.camera.eye()[1], ratio = c.floor->height / eye;
        if (eye > 0 && (ratio > 6 || ratio < 1 / 6.))
            c.doubt("scale", "the floor lies " + shown(c.floor->height) +
                                 " m below the eye, which is said to stand " + shown(eye) + " m up");
    }
}

void doubtQuantisation(Case& c) {
    const DepthStatistics& s = c.statistics;
    const double finite = (1 - s.unknown - s.sky) * double(c.capture.stored.total());
    if (finite > 20000 && s.distinct <= 256 && (s.step > .012 || (s.step > .003 && s.even)))
        c.doubt("quantised", "only " + std::to_string(s.distinct) + " different depths among " +
                                 shown(finite / 1e6) + " million pixels, at the median " + percent(s.step) +
                                 " apart: it went through 8 bits");
}

void doubtOverlay(Case& c) {
    if (has(c, "polarity") || has(c, "disparity")) return;
    const NearCluster n = nearCluster(c.thin.depth);
    if (n.gap < 2.5 || n.share < .003 || n.lowerShare < .6) return;
    c.doubt("overlay", percent(n.share) + " of the picture, mostly in its lower half, is nearer than " +
                           shown(n.farthest) + " m and everything else at least " + shown(n.gap) +
                           " × further: a weapon or display drawn at a depth range of its own");
}

// Numbers up to the top of their 16 bits and a gap below: what was farther than they reach, or not known, was
// cut to the top, and so stands as a wall there. A depth buffer's numbers do crowd at their end.
void doubtCeiling(Case& c) {
    if (isDevice(c.encoding) || c.capture.stored.type() != CV_16U) return;
    const cv::Mat asStored =
        decodeDepth(c.capture.stored, c.encoding,
                    c.capture.frame.camera.resized(c.capture.frame.size(), c.capture.stored.size()));
    constexpr int top = 65535, pileFrom = top - top / 50, gapFrom = top / 2;
    size_t known = 0, pile = 0, below = 0;
    for (int j = 0; j < asStored.rows; ++j)
        for (int i = 0; i < asStored.cols; ++i) {
            if (!std::isfinite(asStored.at<float>(j, i))) continue;
            const int stored = c.capture.stored.at<uint16_t>(j, i);
            known++;
            pile += stored >= pileFrom;
            below += stored >= gapFrom && stored < pileFrom;
        }
    if (known == 0 || double(pile) < .01 * double(known) || double(below) > .1 * double(pile)) return;
    c.doubt("ceiling",
            percent(double(pile) / double(known)) +
                " of the depth lies just under the largest number that 16 bits hold and hardly any in the "
                "half below: what is farther, or unknown, was cut to it (say so: sky_at_or_above=" +
                std::to_string(pileFrom) + " for sky, or unknown)");
}

// Pixels of another size, or a digit lost: the picture would be seen hardly at all, or nearly half around.
void doubtCamera(Case& c) {
    const Camera& camera = c.capture.frame.camera;
    const cv::Size size = c.capture.frame.size();
    const double degrees =
        (std::atan(camera.cx / camera.fx) + std::atan((size.width - camera.cx) / camera.fx)) * 180 / CV_PI;
    const double x = camera.cx / size.width - .5, y = camera.cy / size.height - .5;
    const double aspect = camera.fx / camera.fy;
    const std::string picture = text("of a picture of ", size.width, " × ", size.height);
    if (std::max(std::abs(x), std::abs(y)) > .25)
        c.doubt("camera", "the centre " + shown(camera.cx) + ", " + shown(camera.cy) + ' ' + picture +
                              " lies far from its middle: are these numbers of another size, or cropped?");
    else if (degrees > 150 || degrees < 3)
        c.doubt("camera", "with f " + shown(camera.fx) + " px the camera " + picture + " sees " +
                              shown(degrees) + "° across: are these pixels of another size?");
    else if (aspect > 1.25 || aspect < .8)
        c.doubt("camera", "fx " + shown(camera.fx) + " and fy " + shown(camera.fy) +
                              " px make pixels that are far from square");
}

}  // namespace

const std::vector<std::string>& doubtNames() {
    static const std::vector<std::string> names = {"range",   "polarity",  "disparity", "mirrored",
                                                   "flipped", "far plane", "scale",     "quantised",
                                                   "overlay", "ceiling",   "holes",     "camera"};
    return names;
}

DepthStatistics depthStatistics(const cv::Mat& depth) {
    std::vector<float> z;
    size_t unknown = 0, sky = 0;
    for (int j = 0; j < depth.rows; ++j)
        for (int i = 0; i < depth.cols; ++i) {
            const float v = depth.at<float>(j, i);
            if (std::isnan(v))
                ++unknown;
            else if (std::isinf(v))
                ++sky;
            else
                z.push_back(v);
        }
    DepthStatistics s;
    s.unknown = double(unknown) / double(depth.total());
    s.sky = double(sky) / double(depth.total());
    if (z.empty()) return s;
    std::sort(z.begin(), z.end());
    const auto at = [&](double share) { return double(z[size_t(share * double(z.size() - 1))]); };
    s.least = z.front();
    s.p1 = at(.01);
    s.p10 = at(.1);
    s.median = at(.5);
    s.p90 = at(.9);
    s.p99 = at(.99);
    s.greatest = z.back();
    const float tenth = float(s.p10), median = float(s.median), nine = float(s.p90);
    z.erase(std::unique(z.begin(), z.end()), z.end());
    s.distinct = z.size();
    const auto stepAt = [&](float from) {
        const auto next = std::upper_bound(z.begin(), z.end(), from);
        return next == z.end() ? 0. : double(*next) - from;
    };
    s.step = stepAt(median) / median;
    const double low = stepAt(tenth), high = stepAt(nine);
    s.even = low > 0 && high > .8 * low && high < 1.25 * low;
    return s;
}

std::vector<Doubt> findDoubts(const Capture& capture, const DepthEncoding& encoding) {
    std::vector<Doubt> doubts;
    // As stored: filters of a smaller image would hide its steps and follow colour's edges.
    const FramePair& frame = capture.frame;
    const cv::Mat asStored =
        decodeDepth(capture.stored, encoding, frame.camera.resized(frame.size(), capture.stored.size()));
    const FramePair thin = thinned(frame, asStored);
    Case c{capture,
           encoding,
           depthStatistics(asStored),
           thin,
           edgeFit(thin),
           flatness(thin.depth),
           groundOrder(thin.depth),
           findFloor(thin),
           doubts};
    doubtOrientation(c);
    doubtRange(c);
    doubtPolarity(c);
    doubtFarPlane(c);
    doubtScale(c);
    doubtQuantisation(c);
    doubtOverlay(c);
    doubtCeiling(c);
    doubtCamera(c);
    if (c.statistics.unknown > .5)
        c.doubt("holes", percent(c.statistics.unknown) + " of the depth is unknown");
    return doubts;
}

}  // namespace brume
