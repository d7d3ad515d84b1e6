// Where methods fail: each effect's header declares its failure regimes under STABILITY, and this sweeps one
// through its stress, for every method on every backend, against the effect's own fp64 reference.
#pragma once

#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "effect/runner.hpp"

namespace brume {

/// One line of a regime: a method, or another way of doing the same (a depth format).
struct RegimeLine {
    std::string name;
    std::shared_ptr<const nlohmann::json> set, frame;  ///< on top of the regime's own
    bool isAuto = false;                               ///< the plan chooses
    bool onGl = true;                                  ///< false: BACKENDS says "cpu" only
    /// The stress values between which, ends included, its error must be at most half an 8-bit step.
    std::vector<std::pair<double, double>> holds;

    bool holdsAt(double stress) const;
};

/// One entry of STABILITY, with its defaults filled in. Expressions in `set` and `frame` know $stress.
struct Regime {
    std::string effect, name;
    std::string stress, unit;     ///< what is swept
    std::vector<double> values;   ///< ascending; may end in +inf, then NaN
    std::vector<double> refused;  ///< those of them that the header's MIN and MAX must refuse
    std::shared_ptr<const nlohmann::json> set, frame;
    std::vector<RegimeLine> lines;
    std::vector<std::string> autoParameters;
    std::string breaks;  ///< why no method holds there, one sentence; needed where none does

    bool isRefused(double stress) const;
};

/// The regimes of an effect, none if it declares none. Throws Error (Usage) naming file, regime and key.
std::vector<Regime> regimesOf(const EffectHeader& header, bool hasPlan);

/// Whether a line holds over all of a regime's values that are not refused.
bool holdsEverywhere(const Regime& regime, const RegimeLine& line);

/// "0.5 to 1000 px", "everywhere", "nowhere": where a line must hold, as `brume info` says it.
std::string holdsText(const Regime& regime, const RegimeLine& line);

/// "radius from 0.1 to 1000 px": what is swept.
std::string rangeText(const Regime& regime);

/// A stress value as a reader wants it: "0.1", "65504", "1e-9", "NaN".
std::string stressText(double stress);

/// A frame made for a regime; `truth` is the depth before it was stored, where the frame quantises it.
struct ProbeFrame {
    FramePair frame;
    cv::Mat truth;
};

/// Makes the frame that FRAME describes once its expressions have become numbers; keys in docs/DESIGN.md.
/// Throws Error (Usage) naming `where` and the key.
ProbeFrame probeFrame(const nlohmann::json& description, const std::string& where);

/// One sweep's result at one stress value.
struct StabilityPoint {
    double stress = 0;
    double error = 0;      ///< worst pixel, in 8-bit steps after encoding; +inf where classes differ
    bool refused = false;  ///< the header's MIN and MAX do not allow this value
    std::string chosen;    ///< auto: the methods chosen, or "skipped"
    std::string problem;   ///< why the error is infinite, or what the run threw
    bool holds() const;
};

/// Where a line passes the tolerance: between a point that holds and a neighbour that does not.
struct Crossing {
    size_t after = 0;  ///< the first of the two points' place
    double near =
        0;  ///< stress where a straight line on logarithmic scales passes; 0 where none can be drawn
};

struct StabilityLine {
    std::string name;
    Backend backend = Backend::Cpu;
    std::vector<StabilityPoint> points;  ///< one for each of the regime's values

    std::vector<Crossing> crossings() const;
};

/// Sweeps a regime. `runners` are each asked for every line; `progress` is called after each stress value.
/// Deterministic. What a run throws becomes the point's problem.
std::vector<StabilityLine> sweepRegime(const std::shared_ptr<const Effect>& effect, const Regime& regime,
                                       const std::vector<Runner*>& runners,
                                       const std::function<void()>& progress = {});

/// What contradicts the header's map, one sentence each; empty where the map is true. A line has to hold
/// where it says so and nowhere else. Where one fails, auto must hold; BREAKS excuses auto only where no
/// method holds, and the others only where there is no auto or it is excused. Values that must be refused
/// are, no others.
std::vector<std::string> contradictions(const Regime& regime, const std::vector<StabilityLine>& lines);

}  // namespace brume
