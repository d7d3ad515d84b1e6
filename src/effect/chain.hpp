// A preset bound to effects: the ordered steps that a runner executes.
#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "effect/effect.hpp"
#include "frame/resolve.hpp"

namespace brume {

struct Step {
    std::shared_ptr<const Effect> effect;
    std::string id;          ///< how --set names it: the effect's name, or its own `id`
    ParameterValues values;  ///< complete: every parameter of the header
    /// parameters that the preset or command line named: a sidecar does not override them
    std::set<std::string> given;
    std::string input = "color";
    std::string output = "color";
    bool enabled = true;

    /// The name of the image that image parameter reads: its value, or `input` for the main one.
    std::string imageOf(const std::string& parameter) const;
    /// True where one of its image parameters is bound to that image.
    bool reads(const std::string& image) const;
};

/// Names of images: "color" (running), "captured" (as it came), "transmittance" (running, starts at 1), and
/// outputs.
struct Chain {
    std::string name, description;
    DepthPolicy policy;
    std::vector<Step> steps;

    /// True where a later step after `from` or `keep` reads "transmittance".
    bool readsTransmittance(const std::vector<std::string>& keep) const;
    /// True where an enabled step has no CPU half.
    bool needsGl() const;
};

/// What was decided about one step, for --explain.
struct StepPlan {
    std::string id;
    Plan plan;
    bool planned = false;  ///< false: nothing to decide, run as written
    double tolerance = 0;  ///< its share of the error that nobody sees, in the unit of Plan::predictedError
};

/// Gives parameters with a SIDECAR key, unless the preset named them, what the frame's sidecar says.
/// "lights/point" is the list of rows of "lights" whose "type" is "point"; "lights/directional/direction" one
/// value of the first such row. Fields that the parameter does not have are ignored. Throws Error (Usage) on
/// a value of the wrong form.
Chain withSidecar(const Chain& chain, const FramePair& frame);

/// What plans know of a captured frame; its depth has been resolved.
FrameStatistics measureFrame(const FramePair& frame);

/// Colour parameters that are "auto" get the picture's own airlight (frame/airlight.hpp); `why` (may be null)
/// gets a sentence for each step id that has one.
Chain withAirlight(const Chain& chain, const FramePair& frame,
                   std::map<std::string, std::string>* why = nullptr);

}  // namespace brume
