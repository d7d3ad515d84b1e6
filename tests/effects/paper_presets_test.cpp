// The papers' printed numbers, in the presets that are named for them, in our units.
#include <gtest/gtest.h>

#include "effect/preset.hpp"
#include "error.hpp"

namespace brume {
namespace {

// What one value is; of a point or colour, a component.
struct Printed {
    const char* preset;
    const char* parameter;  // "list.field" of the list's first row
    int component;
    double value;
};

const double saturated = 2.995732274;  // -ln .05: Lanman's distance to saturation is this over the extinction

// Gawron's lengths are cm, z up: their (x, y, z) is our (x, z, y), and what they add to a position moves
// noise the other way. Lanman's noise moves by Unity's _Time.x, a twentieth of the seconds.
const Printed printed[] = {{"gawron_listing", "start", 0, 0},
                           {"gawron_listing", "power_distance", 0, 1000 / 100.},
                           {"gawron_listing", "power_exponent", 0, .55},
                           {"gawron_listing", "wind", 0, -200 / 100.},
                           {"gawron_listing", "wind", 1, 0},
                           {"gawron_listing", "wind", 2, -25 / 100.},
                           {"gawron_listing", "low", 0, .12},
                           {"gawron_listing", "high", 0, .18},
                           {"gawron_listing", "max_opacity", 0, .5},
                           {"gawron_listing", "sun_offset", 0, 1000 / 100.},
                           {"gawron_listing", "sun_exponent", 0, 4},
                           {"gawron_listing", "color", 0, .45},
                           {"gawron_listing", "color", 1, .64},
                           {"gawron_listing", "color", 2, 1},
                           {"gawron_listing", "sun_color", 0, 1},
                           {"gawron_listing", "sun_color", 1, .65},
                           {"gawron_listing", "sun_color", 2, .28},
                           {"gawron_sunset", "power_exponent", 0, .55},
                           {"gawron_sunset", "max_opacity", 0, .5},
                           {"gawron_sunset", "sun_offset", 0, 10},
                           {"gawron_sunset", "sun_exponent", 0, 4},
                           {"lanman_trial_1", "steps", 0, 128},
                           {"lanman_trial_1", "density", 0, saturated / 500},
                           {"lanman_trial_2", "steps", 0, 128},
                           {"lanman_trial_2", "density", 0, saturated / 500},
                           {"lanman_trial_2", "height_start", 0, 100},
                           {"lanman_trial_2", "height_distance", 0, 200},
                           {"lanman_trial_2", "shadow_strength", 0, .5},
                           {"lanman_trial_3", "steps", 0, 128},
                           {"lanman_trial_3", "boxes.size", 0, 1000},
                           {"lanman_trial_3", "boxes.size", 1, 300},
                           {"lanman_trial_3", "boxes.size", 2, 1000},
                           {"lanman_trial_3", "boxes.density", 0, saturated / 350},
                           {"lanman_trial_3", "boxes.height_start", 0, 100},
                           {"lanman_trial_3", "boxes.height_distance", 0, 200},
                           {"lanman_trial_3", "boxes.edge_start_x", 0, 35},
                           {"lanman_trial_3", "boxes.edge_start_z", 0, 35},
                           {"lanman_trial_3", "shadow_strength", 0, .5},
                           {"lanman_trial_3", "noise_strength", 0, 1},
                           {"lanman_trial_3", "noise_size", 0, 100},
                           {"lanman_trial_3", "wind", 0, 1000 / 20.},
                           {"lanman_trial_3", "wind", 1, 0},
                           {"lanman_trial_3", "wind", 2, 0},
                           {"lanman_trial_3", "point_lights.range", 0, 150},
                           {"lanman_trial_3", "point_lights.intensity", 0, 1},
                           {"lanman_trial_3", "point_lights.color", 0, 0},
                           {"lanman_trial_3", "point_lights.color", 1, 1},
                           {"lanman_trial_3", "point_lights.color", 2, 0},
                           {"lanman_trial_3", "point_lights.attenuation", 0, .1},
                           {"lanman_trial_3", "point_lights.attenuation", 1, .00005},
                           {"lanman_trial_3", "point_lights.attenuation", 2, .0005}};

TEST(PaperPresets, HoldThePrintedNumbers) {
    for (const Printed& p : printed) {
        const Chain chain = readPreset(p.preset, EffectRegistry::standard());
        const ParameterValues* values = &chain.steps.at(0).values;
        std::string name = p.parameter;
        if (const size_t dot = name.find('.'); dot != std::string::npos) {
            values = &values->at(name.substr(0, dot)).rows.at(0);
            name = name.substr(dot + 1);
        }
        EXPECT_NEAR(values->at(name).numbers.at(size_t(p.component)), p.value,
                    1e-7 * std::max(1., std::abs(p.value)))
            << p.preset << ": " << p.parameter << "[" << p.component << "]";
    }
    // What falls off exponentially there does here.
    const auto chain = readPreset("lanman_trial_3", EffectRegistry::standard());
    for (const char* falloff : {"height_falloff", "edge_falloff"})
        EXPECT_EQ(chain.steps[0].values.at("boxes").rows.at(0).at(falloff).numbers.at(0), 2) << falloff;
    // .12 to .18 of (x/10 m)^.55 is on average (x/D)^.55, D = 10·.15^(-1/.55).
    EXPECT_NEAR(readPreset("gawron_sunset", EffectRegistry::standard())
                    .steps[0]
                    .values.at("power_distance")
                    .numbers[0],
                10 * std::pow(.15, -1 / .55), .1);
}

}  // namespace
}  // namespace brume
