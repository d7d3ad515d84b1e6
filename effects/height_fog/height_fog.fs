/*{
    "ISFVSN": "2",
    "DESCRIPTION": "Layered fog: extinction that depends on height alone, integrated along the view ray.",
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
         "HINT": "extinction at the height below; 3/density is the distance at which 5 % remains",
         "WHEN": "$profile == $profile_exponential"},
        {"NAME": "height", "TYPE": "float", "UNIT": "m", "DEFAULT": 0, "MIN": -2e7, "MAX": 2e7, "UI_MIN": -50, "UI_MAX": 200, "GROUP": "exponential",
         "WHEN": "$profile == $profile_exponential && $density > 0"},
        {"NAME": "falloff", "TYPE": "float", "UNIT": "1/m", "DEFAULT": 0.1, "MIN": 0, "MAX": 100, "UI_MAX": 2, "GROUP": "exponential",
         "HINT": "density falls to 1/e over 1/falloff metres of height",
         "WHEN": "$profile == $profile_exponential && $density > 0"},
        {"NAME": "tint", "TYPE": "color", "DEFAULT": [1, 1, 1, 1], "MIN": 0, "MAX": 10, "UI_MAX": 1, "GROUP": "exponential",
         "HINT": "density of each colour channel as a part of the density: smog, water",
         "WHEN": "$profile == $profile_exponential && $density > 0"},
        {"NAME": "density2", "TYPE": "float", "LABEL": "density, second layer", "UNIT": "1/m", "DEFAULT": 0, "MIN": 0, "MAX": 1000, "UI_MAX": 0.5, "GROUP": "exponential",
         "WHEN": "$profile == $profile_exponential"},
        {"NAME": "height2", "TYPE": "float", "LABEL": "height, second layer", "UNIT": "m", "DEFAULT": 0, "MIN": -2e7, "MAX": 2e7, "UI_MIN": -50, "UI_MAX": 200, "GROUP": "exponential",
         "WHEN": "$profile == $profile_exponential && $density2 > 0"},
        {"NAME": "falloff2", "TYPE": "float", "LABEL": "falloff, second layer", "UNIT": "1/m", "DEFAULT": 0.5, "MIN": 0, "MAX": 100, "UI_MAX": 2, "GROUP": "exponential",
         "WHEN": "$profile == $profile_exponential && $density2 > 0"},
        {"NAME": "tint2", "TYPE": "color", "LABEL": "tint, second layer", "DEFAULT": [1, 1, 1, 1], "MIN": 0, "MAX": 10, "UI_MAX": 1, "GROUP": "exponential",
         "WHEN": "$profile == $profile_exponential && $density2 > 0"},

        {"NAME": "ramp", "TYPE": "list", "MAX": 4, "GROUP": "ramp", "HINT": "density, linear in height between up to four points, constant beyond them",
         "FIELDS": [{"NAME": "height", "TYPE": "float", "UNIT": "m", "DEFAULT": 0, "MIN": -2e7, "MAX": 2e7, "UI_MIN": -10, "UI_MAX": 30},
                    {"NAME": "density", "TYPE": "float", "UNIT": "1/m", "DEFAULT": 0.05, "MIN": 0, "MAX": 1000, "UI_MAX": 0.5},
                    {"NAME": "tint", "TYPE": "color", "DEFAULT": [1, 1, 1, 1], "MIN": 0, "MAX": 10, "UI_MAX": 1}],
         "DEFAULT": [{"height": 0, "density": 0.08}, {"height": 2, "density": 0.08}, {"height": 6, "density": 0}],
         "WHEN": "$profile == $profile_ramp"},

        {"NAME": "table", "TYPE": "list", "MAX": 256, "GROUP": "table", "HINT": "densities at equal steps of height from the bottom to the top, linear between, constant beyond",
         "FIELDS": [{"NAME": "density", "TYPE": "float", "UNIT": "1/m", "DEFAULT": 0.05, "MIN": 0, "MAX": 1000, "UI_MAX": 0.5},
                    {"NAME": "tint", "TYPE": "color", "DEFAULT": [1, 1, 1, 1], "MIN": 0, "MAX": 10, "UI_MAX": 1}],
         "DEFAULT": [{"density": 0.02}, {"density": 0.08}, {"density": 0.05}, {"density": 0.1}, {"density": 0}],
         "WHEN": "$profile == $profile_table"},
        {"NAME": "table_bottom", "TYPE": "float", "UNIT": "m", "DEFAULT": 0, "MIN": -2e7, "MAX": 2e7, "UI_MIN": -50, "UI_MAX": 200, "GROUP": "table",
         "HINT": "height of the first density; the methods with a table tabulate every profile from here ...",
         "WHEN": "$profile == $profile_table || $method == $method_table_linear || $method == $method_table_hermite"},
        {"NAME": "table_top", "TYPE": "float", "UNIT": "m", "DEFAULT": 20, "MIN": -2e7, "MAX": 2e7, "UI_MIN": -50, "UI_MAX": 200, "GROUP": "table",
         "HINT": "... to here, and hold the density beyond",
         "WHEN": "$profile == $profile_table || $method == $method_table_linear || $method == $method_table_hermite"},
        {"NAME": "table_size", "TYPE": "long", "UNIT": "nodes", "DEFAULT": 256, "MIN": 2, "MAX": 4096, "UI_MAX": 1024, "GROUP": "method",
         "WHEN": "$method == $method_table_linear || $method == $method_table_hermite"},
        {"NAME": "steps", "TYPE": "long", "DEFAULT": 32, "MIN": 1, "MAX": 1024, "UI_MAX": 128, "GROUP": "method",
         "WHEN": "$method == $method_march"}
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
        {"NAME": "table_base", "TYPE": "int", "DESCRIPTION": "the node nearest the eye", "FROM": ["camera", "profile", "method", "table", "table_size", "table_bottom", "table_top"]},
        {"NAME": "table_base_height", "TYPE": "float", "DESCRIPTION": "its height above the eye, m", "FROM": ["camera", "profile", "method", "table", "table_size", "table_bottom", "table_top"]},
        {"NAME": "table_density", "TYPE": "vec4 array", "SIZE": "$table_nodes", "DESCRIPTION": "rgb density at each node",
         "FROM": ["profile", "method", "density", "height", "falloff", "tint", "density2", "height2", "falloff2", "tint2", "ramp", "table", "table_bottom", "table_top", "table_size"]},
        {"NAME": "table_mean", "TYPE": "vec4 array", "SIZE": "$table_nodes", "DESCRIPTION": "rgb mean density between a node and the next",
         "FROM": ["profile", "method", "density", "height", "falloff", "tint", "density2", "height2", "falloff2", "tint2", "ramp", "table", "table_bottom", "table_top", "table_size"]},
        {"NAME": "table_to_node", "TYPE": "vec4 array", "SIZE": "$table_nodes", "DESCRIPTION": "rgb mean density from the eye to each node",
         "FROM": ["camera", "profile", "method", "density", "height", "falloff", "tint", "density2", "height2", "falloff2", "tint2", "ramp", "table", "table_bottom", "table_top", "table_size"]}
    ],
    "CHART": {
        "REFERENCE": {"method": "closed form", "table_size": 8, "steps": 1},
        "CASES": [
            {"NAME": "exponential", "SET": {"profile": "exponential"}},
            {"NAME": "ramp", "SET": {"profile": "ramp"}}
        ],
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
    ],
    "STABILITY": [
        {"NAME": "level ways", "STRESS": {"NAME": "change of height along the way", "UNIT": "m", "RANGE": [1e-9, 1000], "PER_DECADE": 1},
         "FRAME": {"HEIGHT": 9, "RISE": "$stress", "DEPTH": 60}, "SET": {"density": 0.05, "falloff": 0.1, "table_bottom": -20, "table_top": 30, "table_size": 512},
         "HOLDS": {"table linear": [1e-09, 10], "table Hermite": [1e-09, 10], "march": [1e-09, 100]}},
        {"NAME": "level ways through a ramp", "STRESS": {"NAME": "change of height along the way", "UNIT": "m", "RANGE": [1e-9, 1000], "PER_DECADE": 1},
         "FRAME": {"HEIGHT": 9, "RISE": "$stress", "DEPTH": 60}, "SET": {"profile": "ramp", "table_bottom": -20, "table_top": 30, "table_size": 512},
         "HOLDS": {"march": [1e-09, 10]}},
        {"NAME": "steep falloff", "STRESS": {"NAME": "falloff times change of height", "RANGE": [1e-3, 1000], "PER_DECADE": 2},
         "FRAME": {"HEIGHT": 9, "RISE": 10, "DEPTH": 60}, "SET": {"falloff": "$stress / 10", "table_bottom": -10, "table_top": 20},
         "HOLDS": {"table linear": [[0.001, 3], [100, 1000]]}},
        {"NAME": "world offset", "STRESS": {"NAME": "distance from the world's origin", "UNIT": "m", "RANGE": [1, 1e7], "PER_DECADE": 1},
         "FRAME": {"SCENE": "ground", "EYE": ["$stress", "$stress + 1.6", "-$stress"], "DEPTH": 40},
         "SET": {"height": "$stress", "falloff": 0.3, "table_bottom": "$stress - 3", "table_top": "$stress + 60", "table_size": 1024, "steps": 256}},
        {"NAME": "optical depth", "STRESS": {"NAME": "optical depth", "RANGE": [1e-9, 1000], "PER_DECADE": 1},
         "FRAME": {"HEIGHT": 9, "RISE": 1e-3, "DEPTH": 100},
         "SET": {"density": "$stress / 100", "height": 1.6, "color": ["min(65504, 1 / $stress)", "min(65504, 0.1 / $stress)", 0.5], "table_size": 1024}},
        {"NAME": "march through a thin layer", "STRESS": {"NAME": "steps", "VALUES": [1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024]},
         "FRAME": {"HEIGHT": 9, "RISE": 12, "DEPTH": 60}, "SET": {"falloff": 1, "steps": "$stress"}, "METHODS": ["march"],
         "HOLDS": {"march": [32, 1024]}},
        {"NAME": "coarse tables", "STRESS": {"NAME": "nodes of the table", "VALUES": [2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 4096]},
         "FRAME": {"HEIGHT": 9, "RISE": 1, "DEPTH": 60}, "SET": {"table_bottom": 0, "table_top": 50, "table_size": "$stress"}, "METHODS": ["table linear", "table Hermite"],
         "HOLDS": {"table linear": [128, 4096], "table Hermite": [4, 4096]}}
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

// 2. ramp: over each linear piece, the density half-way, weighted by how much of the way lies in it
vec3 rampDensity(float y) {
    vec3 rho = ramp_knots[0].rgb;
    // from the knot below: a sum of all rises up to y would keep the rounding of knots far from the eye
    for (int k = 0; k < 3; k++)
        if (y > ramp_knots[k].w) rho = ramp_knots[k].rgb + ramp_slopes[k].rgb * (y - ramp_knots[k].w);
    return y > ramp_knots[3].w ? ramp_knots[3].rgb : rho;
}
vec3 rampMean(float dy) {
    float low = min(dy, 0.0), high = max(dy, 0.0), way = high - low;
    if (way < 1e-30) return eye_density;
    vec3 sum = max(min(high, ramp_knots[0].w) - low, 0.0) * ramp_knots[0].rgb;
    for (int k = 0; k < 3; k++) {
        float from = max(low, ramp_knots[k].w), to = min(high, ramp_knots[k + 1].w);
        float middle = 0.5 * (from + to) - ramp_knots[k].w;
        sum += max(to - from, 0.0) * (ramp_knots[k].rgb + ramp_slopes[k].rgb * middle);
    }
    sum += max(high - max(low, ramp_knots[3].w), 0.0) * ramp_knots[3].rgb;
    return sum / way;
}

// 3. table: whole cells from the integral, the rest by the cell's own rule. Nodes are counted from the eye's, not from
// the first: that may be so far that fp32 holds its height to a metre only. Inside a cell, the way is counted from the
// node on the eye's side: of a density that falls from great to little at the eye, the other's share is 1's rounding.
int tableCell(float y) {
    float cell = floor((y - table_base_height) / table_step) + float(table_base);
    return int(clamp(cell, -1.0, float(table_nodes - 1)));
}
float tableNode(int cell) { return table_base_height + float(cell - table_base) * table_step; }
// 3.1 the mean inside one cell, between two heights
vec3 tableCellMean(int cell, float y0, float y1) {
    if (cell < 0) return table_density[0].rgb;
    if (cell >= table_nodes - 1) return table_density[table_nodes - 1].rgb;
    vec3 m = table_mean[cell].rgb;
    if (method == method_table_linear) return m;
    bool isBelow = cell < table_base;
    int near = isBelow ? cell + 1 : cell;
    vec3 a = table_density[near].rgb, b = table_density[isBelow ? cell : cell + 1].rgb;
    float t0 = min(abs(y0 - tableNode(near)) / table_step, 1.0);
    float t1 = min(abs(y1 - tableNode(near)) / table_step, 1.0);
    float t = 0.5 * (t0 + t1);
    if (method != method_table_hermite) return a + (b - a) * t;
    // the derivative of the cubic through both integrals and slopes, averaged exactly by Simpson's rule
    vec3 s = vec3(t0, t, t1);
    vec3 wm = 6.0 * s * (1.0 - s), wa = (1.0 - s) * (1.0 - 3.0 * s), wb = s * (3.0 * s - 2.0);
    vec3 simpson = vec3(1.0, 4.0, 1.0) / 6.0;
    return max(m * dot(wm, simpson) + a * dot(wa, simpson) + b * dot(wb, simpson), 0.0);
}
vec3 tableMean(float dy) {
    int eye = tableCell(0.0), cell = tableCell(dy);
    if (cell == eye) return tableCellMean(cell, 0.0, dy);
    int node = cell > eye ? cell : cell + 1;
    float y = tableNode(node);
    // as means, so that the rounding of a node's height counts only where they differ; a cubic through too few nodes
    // can dip below 0
    return max(table_to_node[node].rgb * (y / dy) + tableCellMean(cell, y, dy) * ((dy - y) / dy), 0.0);
}

// 4. march: the mean of ρ at the middles of equal steps
vec3 densityAt(float y) {
    if (profile == profile_ramp) return rampDensity(y);
    if (profile == profile_table) return tableCellMean(tableCell(y), y, y);
    vec3 rho = vec3(0.0);
    if (density > 0.0) rho += tint.rgb * exp(min(log_density.x - falloff * y, 60.0));
    if (density2 > 0.0) rho += tint2.rgb * exp(min(log_density.y - falloff2 * y, 60.0));
    return rho;
}
vec3 marchMean(float dy) {
    vec3 sum = vec3(0.0);
    for (int k = 0; k < steps; k++) sum += densityAt(dy * ((float(k) + 0.5) / float(steps)));
    return sum / float(steps);
}

vec3 meanDensity(float dy) {
    if (method == method_march) return marchMean(dy);
    if (profile == profile_table || method == method_table_linear || method == method_table_hermite)
        return tableMean(dy);
    return profile == profile_ramp ? rampMean(dy) : layersMean(dy);
}

// 5. optical depth of the way of length L in a direction that climbs `up` metres per metre
vec3 opticalDepth(float L, float up) {
    if (L > endless) {
        if (up == 0.0) return eye_density * endless;
        return (up > 0.0 ? depth_above : depth_below) / abs(up);
    }
    return L * meanDensity(L * up);
}

void main() {
    ivec2 p = pixel();
    vec4 scene = fetch(inputImage, p);
    vec3 ray = rayOf(p);
    float L = depthAt(p) * rayLength(ray);
    vec3 transmittance, opacity;
    extinctionOf(opticalDepth(L, directionOf(ray).y), transmittance, opacity);
    storeFog(scene, color.rgb, transmittance, opacity);
}
