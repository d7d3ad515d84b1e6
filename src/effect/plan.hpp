// The plan: model no more than this frame needs (MODELS.md §9).
#pragma once

#include <map>
#include <opencv2/core/types.hpp>
#include <string>
#include <vector>

namespace brume {

enum class Backend { Cpu, Gl };

/// Taken once from the captured frame (after depth has been resolved).
struct FrameStatistics {
    cv::Size size;
    double skyShare = 0;                      ///< 0..1
    double minDistance = 0, maxDistance = 0;  ///< m along the ray, finite depths only; 0, 0 if there is none
    double minHeight = 0, maxHeight = 0;      ///< m, world y of surfaces
    double eyeHeight = 0;
    double maxRayUp = 0, minRayUp = 0;  ///< range of the unit ray's world y over the image
    double maxColor = 0;                ///< largest finite channel
    double maxLuminance = 0;
    /// Share of pixels by log2 of distance, bins of one octave from 2^-8 m; sky is not in it.
    std::vector<double> depthHistogram;
};

struct PlanInput {
    FrameStatistics frame;
    Backend backend = Backend::Cpu;
    double tolerance = 1. / 510;  ///< allowed error of this effect, |enc(clip(auto)) - enc(clip(reference))|
    double maxInput = 0;          ///< upper bound of a channel arriving from the effects before
    bool transmittanceIsRead = false;
};

struct Plan {
    bool skip = false;                   ///< the effect cannot change a pixel by the tolerance
    std::map<std::string, long> chosen;  ///< value of each parameter that was "auto"
    double predictedError = 0;           ///< in the tolerance's unit
    double predictedCost = 0;            ///< in frame copies
    double maxOutput = 0;                ///< upper bound of a channel leaving
    std::string why;                     ///< one sentence
};

}  // namespace brume
