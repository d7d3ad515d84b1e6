/*{
    "ISFVSN": "2",
    "DESCRIPTION": "Layered fog: extinction that depends on height alone, integrated along the view ray (P3)",
    "CREDIT": "P3: post-process layered fog, eqs 6-9",
    "CATEGORIES": ["fog"],
    "SPACE": "linear",
    "POINTWISE": true,
    "WRITES": ["transmittance"],
    "INPUTS": [
        {"NAME": "inputImage", "TYPE": "image"},
        {"NAME": "color", "TYPE": "color", "LABEL": "fog colour", "DEFAULT": [0.6, 0.65, 0.7, 1], "MIN": 0, "MAX": 65504, "UI_MAX": 1,
         "HINT": "airlight: what an endless way through the fog looks like"},
        {"NAME": "profile", "TYPE": "long", "LABEL": "density profile", "VALUES": [0, 1, 2], "LABELS": ["exponential", "ramp", "table"], "DEFAULT": "exponential"},
        {"NAME": "method", "TYPE": "long", "LABEL": "method", "VALUES": [0, 1, 2, 3], "LABELS": ["closed form", "table linear", "table Hermite", "march"],
         "AUTO": true, "DEFAULT": "auto", "GROUP": "method"},

        {"NAME": "density", "TYPE": "float", "UNIT": "1/m", "DEFAULT": 0.05, "MIN": 0, "MAX": 1000, "UI_MAX": 0.5, "GROUP": "exponential",
         "HINT": "extinction at the height below; 3/density is the distance at which 5 % remains"},
        {"NAME": "height", "TYPE": "float", "UNIT": "m", "DEFAULT": 0, "MIN": -2e7, "MAX": 2e7, "UI_MIN": -50, "UI_MAX": 200, "GROUP": "exponential"},
        {"NAME": "falloff", "TYPE": "float", "UNIT": "1/m", "DEFAULT": 0.1, "MIN": 0, "MAX": 100, "UI_MAX": 2, "GROUP": "exponential",
         "HINT": "density falls to 1/e over 1/falloff metres of height"},
        {"NAME": "tint", "TYPE": "color", "DEFAULT": [1, 1, 1, 1], "MIN": 0, "MAX": 10, "UI_MAX": 1, "GROUP": "exponential",
         "HINT": "density of each colour channel as a part of the density: smog, water"},
        {"NAME": "density2", "TYPE": "float", "LABEL": "density, second layer", "UNIT": "1/m", "DEFAULT": 0, "MIN": 0, "MAX": 1000, "UI_MAX": 0.5, "GROUP": "exponential"},
        {"NAME": "height2", "TYPE": "float", "LABEL": "height, second layer", "UNIT": "m", "DEFAULT": 0, "MIN": -2e7, "MAX": 2e7, "UI_MIN": -50, "UI_MAX": 200, "GROUP": "exponential"},
        {"NAME": "falloff2", "TYPE": "float", "LABEL": "falloff, second layer", "UNIT": "1/m", "DEFAULT": 0.5, "MIN": 0, "MAX": 100, "UI_MAX": 2, "GROUP": "exponential"},
        {"NAME": "tint2", "TYPE": "color", "LABEL": "tint, second layer", "DEFAULT": [1, 1, 1, 1], "MIN": 0, "MAX": 10, "UI_MAX": 1, "GROUP": "exponential"},

        {"NAME": "ramp", "TYPE": "list", "MAX": 4, "GROUP": "ramp", "HINT": "density, linear in height between up to four points, constant beyond them",
         "FIELDS": [{"NAME": "height", "TYPE": "float", "UNIT": "m", "DEFAULT": 0, "MIN": -2e7, "MAX": 2e7, "UI_MIN": -10, "UI_MAX": 30},
                    {"NAME": "density", "TYPE": "float", "UNIT": "1/m", "DEFAULT": 0.05, "MIN": 0, "MAX": 1000, "UI_MAX": 0.5},
                    {"NAME": "tint", "TYPE": "color", "DEFAULT": [1, 1, 1, 1], "MIN": 0, "MAX": 10, "UI_MAX": 1}],
         "DEFAULT": [{"height": 0, "density": 0.08}, {"height": 2, "density": 0.08}, {"height": 6, "density": 0}]},

        {"NAME": "table", "TYPE": "list", "MAX": 256, "GROUP": "table", "HINT": "densities at equal steps of height from the bottom to the top, linear between, constant beyond",
         "FIELDS": [{"NAME": "density", "TYPE": "float", "UNIT": "1/m", "DEFAULT": 0.05, "MIN": 0, "MAX": 1000, "UI_MAX": 0.5},
                    {"NAME": "tint", "TYPE": "color", "DEFAULT": [1, 1, 1, 1], "MIN": 0, "MAX": 10, "UI_MAX": 1}],
         "DEFAULT": [{"density": 0.02}, {"density": 0.08}, {"density": 0.05}, {"density": 0.1}, {"density": 0}]},
        {"NAME": "table_bottom", "TYPE": "float", "UNIT": "m", "DEFAULT": 0, "MIN": -2e7, "MAX": 2e7, "UI_MIN": -50, "UI_MAX": 200, "GROUP": "table",
         "HINT": "height of the first density; the methods with a table tabulate every profile from here ..."},
        {"NAME": "table_top", "TYPE": "float", "UNIT": "m", "DEFAULT": 20, "MIN": -2e7, "MAX": 2e7, "UI_MIN": -50, "UI_MAX": 200, "GROUP": "table",
         "HINT": "... to here, and hold the density beyond"},
        {"NAME": "table_size", "TYPE": "long", "UNIT": "nodes", "DEFAULT": 256, "MIN": 2, "MAX": 4096, "UI_MAX": 1024, "GROUP": "method", "HINT": "of the methods with a table"},
        {"NAME": "steps", "TYPE": "long", "DEFAULT": 32, "MIN": 1, "MAX": 1024, "UI_MAX": 128, "GROUP": "method", "HINT": "of the march"}
    ],
    "DERIVED": [
        {"NAME": "eye_density", "TYPE": "vec3", "DESCRIPTION": "1/m at the eye",
         "FROM": ["camera", "profile", "density", "height", "falloff", "tint", "density2", "height2", "falloff2", "tint2", "ramp", "table", "table_bottom", "table_top"]},
        {"NAME": "depth_above", "TYPE": "vec3", "DESCRIPTION": "optical depth straight up from the eye, at most 1e30",
         "FROM": ["camera", "profile", "density", "height", "falloff", "tint", "density2", "height2", "falloff2", "tint2", "ramp", "table", "table_bottom", "table_top"]},
        {"NAME": "depth_below", "TYPE": "vec3", "DESCRIPTION": "optical depth straight down from the eye, at most 1e30",
         "FROM": ["camera", "profile", "density", "height", "falloff", "tint", "density2", "height2", "falloff2", "tint2", "ramp", "table", "table_bottom", "table_top"]},
        {"NAME": "log_density", "TYPE": "vec2", "DESCRIPTION": "ln of each layer's density at the eye's height, before its tint",
         "FROM": ["camera", "density", "height", "falloff", "density2", "height2", "falloff2"]},
        {"NAME": "ramp_knots", "TYPE": "vec4 array", "SIZE": 4, "DESCRIPTION": "rgb density, height above the eye; ascending, the last repeated",
         "FROM": ["camera", "ramp"]},
        {"NAME": "ramp_slopes", "TYPE": "vec4 array", "SIZE": 4, "DESCRIPTION": "rgb density per metre between a knot and the next",
         "FROM": ["ramp"]},
        {"NAME": "table_nodes", "TYPE": "int", "FROM": ["profile", "method", "table", "table_size"]},
        {"NAME": "table_step", "TYPE": "float", "DESCRIPTION": "m between nodes", "FROM": ["profile", "method", "table", "table_size", "table_bottom", "table_top"]},
        {"NAME": "table_first", "TYPE": "float", "DESCRIPTION": "height of the first node above the eye", "FROM": ["camera", "table_bottom"]},
        {"NAME": "table_density", "TYPE": "vec4 array", "SIZE": "$table_nodes", "DESCRIPTION": "rgb density at each node",
         "FROM": ["profile", "method", "density", "height", "falloff", "tint", "density2", "height2", "falloff2", "tint2", "ramp", "table", "table_bottom", "table_top", "table_size"]},
        {"NAME": "table_mean", "TYPE": "vec4 array", "SIZE": "$table_nodes", "DESCRIPTION": "rgb mean density between a node and the next",
         "FROM": ["profile", "method", "density", "height", "falloff", "tint", "density2", "height2", "falloff2", "tint2", "ramp", "table", "table_bottom", "table_top", "table_size"]},
        {"NAME": "table_integral", "TYPE": "vec4 array", "SIZE": "$table_nodes", "DESCRIPTION": "rgb density integrated from the eye to each node, negative below",
         "FROM": ["camera", "profile", "method", "density", "height", "falloff", "tint", "density2", "height2", "falloff2", "tint2", "ramp", "table", "table_bottom", "table_top", "table_size"]}
    ],
    "CHART": {
        "REFERENCE": {"method": "closed form"},
        "METHODS": [
            {"NAME": "closed form", "SET": {"method": "closed form"}},
            {"NAME": "table linear", "SET": {"method": "table linear"}, "KNOB": "table_size", "VALUES": [8, 16, 32, 64, 128, 256, 1024]},
            {"NAME": "table Hermite", "SET": {"method": "table Hermite"}, "KNOB": "table_size", "VALUES": [8, 16, 32, 64, 128, 256, 1024]},
            {"NAME": "march", "SET": {"method": "march"}, "KNOB": "steps", "VALUES": [1, 2, 4, 8, 16, 32, 64, 128]}
        ]
    },
    "BREAKS": [
        "table linear: a staircase once the way changes height by less than a table step (8 % in density at falloff .1 and steps of 1.56 m).",
        "table linear, table Hermite: exponential and ramp profiles are held constant beyond table_bottom and table_top.",
        "march: needs about sqrt(L^3 |density''|/24 error) steps; on the way to the sky, which no march ends, it is the closed form."
    ]
}*/


// Layered fog: out = C·T + color·(1 - T), T = exp(-τ) per channel, τ = ∫ ρ(y) ds along the view ray
//   = L·(mean of ρ between the eye's height and the surface's)                              (P3 eqs 6-9).
// ρ in 1/m: exponential Σ density·tint·exp(-falloff·(y - height)) over two layers, or linear between the points of a
// ramp or a table. Heights are counted from the eye (derived in fp64): the eye's is 0, the surface's L·d.y.
// Limits: L = 0 or ρ = 0 give T = 1; sky has τ = (∫ of ρ to where the ray goes)/|d.y|; T = 0 gives color whatever C.
// fp32: no difference of two integrals is taken, so level rays and far origins lose nothing.

#include "kit/image.glsl"
#include "kit/view.glsl"
#include "common/fog.glsl"
#include "common/profiles.glsl"

// ways longer than this count as endless
const float endless = 1e30;

// 1. exponential layers
vec3 layersMean(float dy) {
    vec3 mean = vec3(0.0);
    if (density > 0.0) mean += tint.rgb * exponentialMean(log_density.x, falloff, dy);
    if (density2 > 0.0) mean += tint2.rgb * exponentialMean(log_density.y, falloff2, dy);
    return mean;
}

// 2. ramp: over each linear piece, the density half-way, weighted by how much of the way l