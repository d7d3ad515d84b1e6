// The plan: model no more than this frame needs (MODELS.md §9). A plan never reads pixels back: it knows what
// was measured once of the captured frame, and bounds that each effect passes on to the next; what these
// cannot tell it may have the CPU make.
#pragma once

#include <functional>
#include <map>
#include <opencv2/core/mat.hpp>
#include <set>
#include <string>
#include <vector>

#include "effect/derive_context.hpp"

namespace brume {

enum class Backend { Cpu, Gl };

/// What is known of an image: bounds of its colour channels, as a whole and by tiles. Infinite values count
/// as ±65504 and NaN as 0, as blurs take them.
struct ImageBounds {
    static constexpr int tile = 16;  ///< px of the frame along an edge
    double low = -HUGE_VAL, high = HUGE_VAL;
    /// CV_32FC3, one pixel a tile: least and greatest of each channel, and what its mean is at least and at
    /// most; all empty: known as a whole only. In a ring of tiles around them: the same of what an edge
    /// repeats beyond it, the last pixels of each row and column, and the corners'.
    cv::Mat lowest, highest, leastMean, greatestMean;

    /// Where a pixel of the frame belongs in these.
    static cv::Point placeOf(cv::Point pixel) { return pixel / tile + cv::Point(1, 1); }

    /// The bounds after every pixel was mixed with something between `from` and `to`.
    ImageBounds mixedWith(double from, double to) const;
    /// The bounds where places are not kept, within [from, to].
    static ImageBounds anywhere(double from, double to);
};

/// One pixel of the captured frame. Plans try methods on such pixels.
struct Probe {
    cv::Point pixel;
    cv::Vec3d direction;  ///< unit, world
    double distance = 0;  ///< m along the ray, inf: sky
    cv::Vec3d low, high;  ///< bounds of its colour as it arrives; equal where it is known
};

/// Taken once from the captured frame (after depth has been resolved).
struct FrameStatistics {
    cv::Size size;
    double skyShare = 0;                      ///< 0..1
    double minDistance = 0, maxDistance = 0;  ///< m along the ray, finite depths only; 0, 0 if there is none
    double minHeight = 0, maxHeight = 0;      ///< m, world y of surfaces
    double eyeHeight = 0;
    double radiansPerPixel = 0;  ///< at the middle of the image
    ImageBounds color;
    /// CV_32FC4, one pixel a tile of ImageBounds: red, green, blue and distance (m along the ray, inf: sky)
    /// of the pixel where fog would show most, far and dark. Colours as they arrive.
    cv::Mat hardest;
    std::vector<Probe> probes;  ///< the extremes (nearest, farthest, brightest, ...) and some of everywhere
};

struct PlanInput {
    FrameStatistics frame;
    DeriveContext scene;  ///< camera, time, sidecar, as derived constants get them
    /// Image parameters whose pixels are known beforehand: those that the capture brought (a light's depth
    /// map).
    std::map<std::string, cv::Mat> captured;
    Backend backend = Backend::Cpu;
    std::set<std::string> automatic;  ///< the parameters that are "auto": those to choose
    double tolerance = 1. / 510;      ///< allowed error of this effect, in what `visible` returns
    /// What the steps up to this one may err together, less what those before are predicted to; never less
    /// than `tolerance`. For a plan that tries the picture itself: a bound's slack is no room for others.
    double toleranceLeft = 1. / 510;
    bool isLast = true;  ///< no later step reads what this one writes
    double gain = 1;     ///< later effects may multiply an error in linear light by at most this
    ImageBounds input;   ///< of the main input image
    cv::Mat color;       ///< CV_32FC4: its pixels where it still is as captured, else empty
    cv::Mat depth;       ///< CV_32FC1: the frame's, m, planar, inf: sky
    std::map<std::string, ImageBounds> images;  ///< of the other image parameters
    double maxInput = 0;                        ///< its largest |channel|
    bool transmittanceIsRead = false;
    /// The pixels that an image parameter will have, made by the CPU halves of the steps before: costs what
    /// those cost, once, when first called. Empty where they have none.
    std::function<cv::Mat(const std::string& parameter)> arriving;

    bool chooses(const std::string& parameter) const { return automatic.count(parameter) > 0; }
    /// Any pixel of the frame, with the colour that arrives there.
    Probe probeAt(cv::Point pixel) const;

    /// How far apart two values of a channel look in the end: |enc(clip(a)) - enc(clip(b))|, sRGB-encoded.
    /// Where later effects might darken it, nothing is clipped, and above 1 only the ratio counts.
    double visible(double a, double b) const;
    /// The largest error in linear light that stays within the tolerance wherever the true value is at least
    /// `lowest`.
    double largestUnseen(double lowest) const;
    /// How visible an effect at most is that mixes, at any pixel, up to `opacity` of a light between `from`
    /// and `to` into the main input.
    double mixingShows(double opacity, double from, double to) const;
};

struct Plan {
    bool skip = false;                     ///< the effect cannot change a pixel by the tolerance
    std::map<std::string, double> chosen;  ///< value of each parameter that is "auto"
    /// Values of "auto" parameters that the model has where a choice leaves some of it out (all octaves,
    /// say): what the reference computes. Others do not matter to it.
    std::map<std::string, double> model;
    double predictedError = 0;     ///< in the tolerance's unit
    bool takesWhatIsLeft = false;  ///< it was held to PlanInput::toleranceLeft, not to `tolerance`
    double predictedCost = 0;      ///< in frame copies, on PlanInput's backend
    ImageBounds output;            ///< of the image leaving
    std::vector<Probe> probes;     ///< with the colours leaving; empty: only known to lie within `output`
    double gain = 1;               ///< by at most this an error arriving in linear light grows
    std::string why;               ///< one sentence
};

}  // namespace brume
