// CHART of an effect file: the problems an effect is measured on, the methods and knobs to sweep, and the
// peers to stand beside them.
//
//   "CHART": {
//     "SET":       {"color": [1, 1, 1]},                    // optional: holds for all that follows
//     "REFERENCE": {"method": "closed form"},               // optional: what the reference is asked with
//     instead "BEFORE":    ["depth_fog"],                           // optional: steps of a preset that run
//     first, untimed "CASES":     [{"NAME": "radius 8", "SET": {"radius": 8}}],       // optional: problems,
//     each with its truth "METHODS":   [{"NAME": "march", "SET": {"method": "march"}, "KNOB": "steps",
//     "VALUES": [1, 2, 4],
//                    "CASES": ["radius 8"], "BACKENDS": ["cpu"]}],     // the last four optional
//     "PEERS":     [{"NAME": "cv::GaussianBlur", "RUN": "peer_opencv", "CASES": ["radius 8"]}]
//   }
//
// The truth of a variant is the effect's reference at the variant's values with REFERENCE's over them.
#pragma once

#include <string>
#include <vector>

#include "effect/header.hpp"

namespace brume {

struct Chart {
    struct Case {
        std::string name;
        ParameterValues set;
    };
    struct Method {
        std::string name;
        ParameterValues set;
        std::string knob;                    ///< parameter, or empty: the method is one point
        std::vector<ParameterValue> values;  ///< of the knob, as written: from coarse to fine
        std::vector<std::string> cases;      ///< empty: all
        bool onCpu = true, onGl = true;
    };
    /// Somebody else's program for the same job, in the effect's folder (src/measure/peer.hpp).
    struct Peer {
        std::string name, run;
        std::vector<std::string> cases;  ///< empty: all
    };
    ParameterValues set, reference;
    std::string before;  ///< the JSON of a preset whose steps run first, or empty
    std::vector<Case> cases;
    std::vector<Method> methods;
    std::vector<Peer> peers;
};

/// One thing to measure: a method at one value of its knob, on one case.
struct ChartVariant {
    std::string caseName;  ///< empty where CHART has no CASES
    std::string method;    ///< the effect's name where there are no METHODS
    std::string knob;      ///< empty: none
    ParameterValue knobValue;
    ParameterValues values;          ///< complete; "auto" only where CHART left a default so
    ParameterValues truth;           ///< complete: what the reference is to be asked with
    std::vector<std::string> given;  ///< the parameters that CHART names: a sidecar does not override them
    bool onCpu = true, onGl = true;
    /// "fir", "march, steps 8", without the case.
    std::string label(const EffectHeader& header) const;
};

/// What to measure of any effect: CHART's methods and knobs on each of its cases, in their order. Without
/// METHODS each choice of a parameter that may be "auto" is a method; without such a parameter, or without
/// CHART at all, the effect at its defaults is the only one.
std::vector<ChartVariant> chartVariants(const EffectHeader& header);

/// True where `names` is empty or holds `name`.
bool listed(const std::vector<std::string>& names, const std::string& name);

}  // namespace brume
