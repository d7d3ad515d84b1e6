/*{
    "ISFVSN": "2",
    "DESCRIPTION": "Heterogeneous fog: density, and colour, driven by coherent noise.",
    "CREDIT": "Gawron and Boryczka 2018 (P1 3.3: power, noise-driven colour), post-process layered fog (P3 3.2.3: product), ocean fog (P5: ocean, baked and smoothed noise)",
    "CATEGORIES": ["Fog"],
    "SPACE": "linear",
    "POINTWISE": true,
    "WRITES": ["transmittance"],
    "INPUTS": [
        {"NAME": "inputImage", "TYPE": "image"},
        {"NAME": "color", "TYPE": "color", "LABEL": "fog colour", "DEFAULT": [0.6, 0.65, 0.7, 1], "MIN": 0, "MAX": 65504, "UI_MAX": 2, "HINT": "airlight where the noise is 0, linear"},
        {"NAME": "color_high", "TYPE": "color", "LABEL": "fog colour, dense", "DEFAULT": [0.7, 0.73, 0.76, 1], "MIN": 0, "MAX": 65504, "UI_MAX": 2, "HINT": "airlight where the noise is 1",
         "WHEN": "$where != $where_as_a_product"},
        {"NAME": "model", "TYPE": "long", "VALUES": [0, 1], "LABELS": ["exponential", "power"], "DEFAULT": "exponential", "HINT": "exponential is physical; power is Gawron's"},
        {"NAME": "where", "TYPE": "long", "LABEL": "noise taken", "VALUES": [0, 1, 2], "LABELS": ["at the surface", "along the ray", "as a product"], "DEFAULT": "at the surface",
         "HINT": "at the surface sticks to geometry (P1, P5); along the ray is the line integral; the product (P3) multiplies each axis' mean"},
        {"NAME": "mode", "TYPE": "long", "LABEL": "noise drives density", "VALUES": [0, 1, 2, 3], "LABELS": ["modulate", "ocean", "additive", "subtractive"], "DEFAULT": "modulate", "GROUP": "density",
         "HINT": "mix(low, high, n); n times half the square of the height below the eye (P5); 1 + strength n; 1 - strength n",
         "WHEN": "$where != $where_as_a_product"},
        {"NAME": "low", "TYPE": "float", "DEFAULT": 0.3, "MIN": 0, "MAX": 100, "UI_MAX": 2, "GROUP": "density", "HINT": "relative density where the noise is 0",
         "WHEN": "$where != $where_as_a_product && $mode == $mode_modulate || $where == $where_as_a_product && ($x_profile == $x_profile_noise || $y_profile == $y_profile_noise || $z_profile == $z_profile_noise)"},
        {"NAME": "high", "TYPE": "float", "DEFAULT": 1.7, "MIN": 0, "MAX": 100, "UI_MAX": 2, "GROUP": "density", "HINT": "relative density where the noise is 1",
         "WHEN": "$where != $where_as_a_product && $mode == $mode_modulate || $where == $where_as_a_product && ($x_profile == $x_profile_noise || $y_profile == $y_profile_noise || $z_profile == $z_profile_noise)"},
        {"NAME": "strength", "TYPE": "float", "DEFAULT": 0.8, "MIN": 0, "MAX": 100, "UI_MAX": 2, "GROUP": "density",
         "WHEN": "$where != $where_as_a_product && ($mode == $mode_additive || $mode == $mode_subtractive)"},
        {"NAME": "start", "TYPE": "float", "UNIT": "m", "DEFAULT": 0, "MIN": 0, "MAX": 1e6, "UI_MAX": 200, "GROUP": "density", "HINT": "nearer than this there is no fog"},
        {"NAME": "density", "TYPE": "float", "UNIT": "1/m", "DEFAULT": 0.03, "MIN": 0, "MAX": 1000, "UI_MAX": 0.5, "GROUP": "density", "HINT": "extinction at a relative density of 1",
         "WHEN": "$model == $model_exponential"},
        {"NAME": "power_distance", "TYPE": "float", "UNIT": "m", "DEFAULT": 100, "MIN": 0.001, "MAX": 1e7, "UI_MAX": 1000, "GROUP": "density", "HINT": "opacity is the relative density this far behind the start",
         "WHEN": "$model == $model_power"},
        {"NAME": "power_exponent", "TYPE": "float", "DEFAULT": 0.55, "MIN": 0.05, "MAX": 16, "UI_MAX": 4, "GROUP": "density",
         "WHEN": "$model == $model_power"},
        {"NAME": "max_opacity", "TYPE": "float", "DEFAULT": 1, "MIN": 0, "MAX": 1, "GROUP": "density"},

        {"NAME": "noise", "TYPE": "long", "VALUES": [0, 1], "LABELS": ["Perlin", "simplex"], "DEFAULT": "Perlin", "GROUP": "noise",
         "WHEN": "$where != $where_as_a_product"},
        {"NAME": "size", "TYPE": "float", "UNIT": "m", "DEFAULT": 10, "MIN": 0.05, "MAX": 1e5, "UI_MIN": 1, "UI_MAX": 200, "GROUP": "noise", "HINT": "of a cell of the first octave",
         "WHEN": "$where != $where_as_a_product || $x_profile == $x_profile_noise || $y_profile == $y_profile_noise || $z_profile == $z_profile_noise"},
        {"NAME": "octaves", "TYPE": "long", "DEFAULT": 3, "MIN": 1, "MAX": 5, "AUTO": true, "GROUP": "noise", "HINT": "auto drops those whose cells are under two pixels even on the nearest surface",
         "WHEN": "$where != $where_as_a_product || $x_profile == $x_profile_noise || $y_profile == $y_profile_noise || $z_profile == $z_profile_noise"},
        {"NAME": "wind", "TYPE": "point3D", "UNIT": "m/s", "DEFAULT": [0, 0, 0], "MIN": -1000, "MAX": 1000, "UI_MIN": -20, "UI_MAX": 20, "GROUP": "noise", "HINT": "the noise drifts with it",
         "WHEN": "$where != $where_as_a_product || $x_profile == $x_profile_noise || $y_profile == $y_profile_noise || $z_profile == $z_profile_noise"},
        {"NAME": "seed", "TYPE": "long", "DEFAULT": 0, "MIN": 0, "MAX": 65535, "GROUP": "noise",
         "WHEN": "$where != $where_as_a_product || $x_profile == $x_profile_noise || $y_profile == $y_profile_noise || $z_profile == $z_profile_noise"},
        {"NAME": "tile", "TYPE": "long", "UNIT": "cells", "VALUES": [4, 8, 16, 32, 64], "LABELS": ["4", "8", "16", "32", "64"], "DEFAULT": "16", "GROUP": "noise", "HINT": "the noise repeats after as many",
         "WHEN": "$where != $where_as_a_product || $x_profile == $x_profile_noise || $y_profile == $y_profile_noise || $z_profile == $z_profile_noise"},
        {"NAME": "extent", "TYPE": "long", "VALUES": [0, 1], "LABELS": ["3-D", "ground"], "DEFAULT": "3-D", "GROUP": "noise", "HINT": "ground: the same at every height (P1)",
         "WHEN": "$where != $where_as_a_product"},
        {"NAME": "method", "TYPE": "long", "VALUES": [0, 1], "LABELS": ["procedural", "baked"], "AUTO": true, "DEFAULT": "auto", "GROUP": "method",
         "WHEN": "$where != $where_as_a_product"},
        {"NAME": "resolution", "TYPE": "long", "UNIT": "texels", "VALUES": [32, 64, 128], "LABELS": ["32", "64", "128"], "DEFAULT": "128", "GROUP": "method", "HINT": "edge of the volume that holds one tile: baked, and smoothing, count in its texels",
         "WHEN": "$where != $where_as_a_product && $method == $method_baked || $where == $where_at_the_surface && $smoothing > 0"},
        {"NAME": "smoothing", "TYPE": "long", "DEFAULT": 0, "MIN": 0, "MAX": 2, "GROUP": "method", "HINT": "blur by row 0, 2 or 4 of Pascal's triangle along each axis, in steps of a texel of the resolution (P5); costs much unless baked",
         "WHEN": "$where == $where_at_the_surface"},
        {"NAME": "steps", "TYPE": "long", "AUTO": true, "DEFAULT": 32, "MIN": 1, "MAX": 512, "UI_MAX": 64, "GROUP": "method",
         "WHEN": "$where == $where_along_the_ray"},
        {"NAME": "range", "TYPE": "float", "UNIT": "m", "DEFAULT": 150, "MIN": 0, "MAX": 1e4, "UI_MAX": 500, "GROUP": "method", "HINT": "farther the noise counts as its mean",
         "WHEN": "$where == $where_along_the_ray"},

        {"NAME": "x_profile", "TYPE": "long", "LABEL": "x profile", "VALUES": [0, 1, 2, 3, 4], "LABELS": ["constant", "exponential", "ramp", "table", "noise"],
         "DEFAULT": "noise", "GROUP": "product", "WHEN": "$where == $where_as_a_product"},
        {"NAME": "x_density", "TYPE": "float", "LABEL": "x density", "DEFAULT": 1, "MIN": 0, "MAX": 100, "UI_MAX": 4, "GROUP": "product", "HINT": "multiplies the x profile",
         "WHEN": "$where == $where_as_a_product"},
        {"NAME": "x_origin", "TYPE": "float", "LABEL": "x origin", "UNIT": "m", "DEFAULT": 0, "MIN": -2e7, "MAX": 2e7, "UI_MIN": -100, "UI_MAX": 100, "GROUP": "product",
         "HINT": "where an exponential profile is 1",
         "WHEN": "$where == $where_as_a_product && $x_profile == $x_profile_exponential"},
        {"NAME": "x_falloff", "TYPE": "float", "LABEL": "x falloff", "UNIT": "1/m", "DEFAULT": 0.1, "MIN": -100, "MAX": 100, "UI_MIN": -1, "UI_MAX": 1, "GROUP": "product",
         "HINT": "an exponential profile falls to 1/e over 1/falloff metres; negative: rises",
         "WHEN": "$where == $where_as_a_product && $x_profile == $x_profile_exponential"},
        {"NAME": "y_profile", "TYPE": "long", "LABEL": "y profile", "VALUES": [0, 1, 2, 3, 4], "LABELS": ["constant", "exponential", "ramp", "table", "noise"],
         "DEFAULT": "exponential", "GROUP": "product", "WHEN": "$where == $where_as_a_product"},
        {"NAME": "y_density", "TYPE": "float", "LABEL": "y density", "DEFAULT": 1, "MIN": 0, "MAX": 100, "UI_MAX": 4, "GROUP": "product", "HINT": "multiplies the y profile",
         "WHEN": "$where == $where_as_a_product"},
        {"NAME": "y_origin", "TYPE": "float", "LABEL": "y origin", "UNIT": "m", "DEFAULT": 0, "MIN": -2e7, "MAX": 2e7, "UI_MIN": -100, "UI_MAX": 100, "GROUP": "product",
         "HINT": "where an exponential profile is 1",
         "WHEN": "$where == $where_as_a_product && $y_profile == $y_profile_exponential"},
        {"NAME": "y_falloff", "TYPE": "float", "LABEL": "y falloff", "UNIT": "1/m", "DEFAULT": 0.1, "MIN": -100, "MAX": 100, "UI_MIN": -1, "UI_MAX": 1, "GROUP": "product",
         "HINT": "an exponential profile falls to 1/e over 1/falloff metres; negative: rises",
         "WHEN": "$where == $where_as_a_product && $y_profile == $y_profile_exponential"},
        {"NAME": "z_profile", "TYPE": "long", "LABEL": "z profile", "VALUES": [0, 1, 2, 3, 4], "LABELS": ["constant", "exponential", "ramp", "table", "noise"],
         "DEFAULT": "noise", "GROUP": "product", "WHEN": "$where == $where_as_a_product"},
        {"NAME": "z_density", "TYPE": "float", "LABEL": "z density", "DEFAULT": 1, "MIN": 0, "MAX": 100, "UI_MAX": 4, "GROUP": "product", "HINT": "multiplies the z profile",
         "WHEN": "$where == $where_as_a_product"},
        {"NAME": "z_origin", "TYPE": "float", "LABEL": "z origin", "UNIT": "m", "DEFAULT": 0, "MIN": -2e7, "MAX": 2e7, "UI_MIN": -100, "UI_MAX": 100, "GROUP": "product",
         "HINT": "where an exponential profile is 1",
         "WHEN": "$where == $where_as_a_product && $z_profile == $z_profile_exponential"},
        {"NAME": "z_falloff", "TYPE": "float", "LABEL": "z falloff", "UNIT": "1/m", "DEFAULT": 0.1, "MIN": -100, "MAX": 100, "UI_MIN": -1, "UI_MAX": 1, "GROUP": "product",
         "HINT": "an exponential profile falls to 1/e over 1/falloff metres; negative: rises",
         "WHEN": "$where == $where_as_a_product && $z_profile == $z_profile_exponential"},
        {"NAME": "points", "TYPE": "list", "MAX": 48, "GROUP": "product", "HINT": "of ramp (linear between, constant beyond) and table profiles (the same, at equal steps from the first to the last position)",
         "FIELDS": [{"NAME": "axis", "TYPE": "long", "DEFAULT": 1, "MIN": 0, "MAX": 2, "HINT": "0 x, 1 y, 2 z"},
                    {"NAME": "position", "TYPE": "float", "UNIT": "m", "DEFAULT": 0, "MIN": -2e7, "MAX": 2e7, "UI_MIN": -50, "UI_MAX": 50},
                    {"NAME": "density", "TYPE": "float", "DEFAULT": 1, "MIN": 0, "MAX": 100, "UI_MAX": 2}],
         "DEFAULT": [{"axis": 0, "position": -40, "density": 0.2}, {"axis": 0, "position": 0, "density": 1}, {"axis": 0, "position": 40, "density": 0.4},
                     {"axis": 1, "position": 0, "density": 1}, {"axis": 1, "position": 8, "density": 0},
                     {"axis": 2, "position": -60, "density": 1}, {"axis": 2, "position": -20, "density": 0.3}, {"axis": 2, "position": 0, "density": 1}],
         "WHEN": "$where == $where_as_a_product && ($x_profile == $x_profile_ramp || $x_profile == $x_profile_table || $y_profile == $y_profile_ramp || $y_profile == $y_profile_table || $z_profile == $z_profile_ramp || $z_profile == $z_profile_table)"},

        {"NAME": "sun_direction", "TYPE": "point3D", "LABEL": "towards the sun", "DEFAULT": [0.3, 0.35, -0.9], "MIN": -1, "MAX": 1, "GROUP": "sun", "SIDECAR": "lights/directional/direction", "HINT": "world, +y up; any length; zero: no sun"},
        {"NAME": "sun_color", "TYPE": "color", "DEFAULT": [0, 0, 0, 1], "MIN": 0, "MAX": 65504, "UI_MAX": 4, "GROUP": "sun", "HINT": "added to the airlight towards the sun"},
        {"NAME": "sun_exponent", "TYPE": "float", "DEFAULT": 4, "MIN": 0.05, "MAX": 256, "UI_MAX": 64, "GROUP": "sun"},
        {"NAME": "sun_offset", "TYPE": "float", "UNIT": "m", "DEFAULT": 0, "MIN": 0, "MAX": 1e4, "UI_MAX": 50, "GROUP": "sun", "HINT": "Gawron's scalar added to the view vector; 0 is physical"}
    ],
    "DERIVED": [
        {"NAME": "noise_cell", "TYPE": "vec3", "DESCRIPTION": "whole cell of the eye in the noise, wrapped to the tile", "FROM": ["camera", "time", "wind", "size", "tile", "where", "extent"]},
        {"NAME": "noise_fraction", "TYPE": "vec3", "DESCRIPTION": "the eye's place in that cell, 0..1", "FROM": ["camera", "time", "wind", "size", "tile", "where", "extent"]},
        {"NAME": "inverse_size", "TYPE": "float", "FROM": ["size"]},
        {"NAME": "inverse_distance", "TYPE": "float", "FROM": ["power_distance"]},
        {"NAME": "to_sun", "TYPE": "vec3", "DESCRIPTION": "unit, or zero", "FROM": ["sun_direction"]},
        {"NAME": "baked_edge", "TYPE": "int", "FROM": ["method", "where", "resolution", "tile"]},
        {"NAME": "baked", "TYPE": "volume", "SIZE": ["$baked_edge", "$baked_edge", "$baked_edge"], "FROM": ["method", "where", "noise", "octaves", "seed", "tile", "resolution", "smoothing"]},
        {"NAME": "axis_log", "TYPE": "vec3", "DESCRIPTION": "ln of each axis' exponential at the eye", "FROM": ["camera", "x_profile", "x_origin", "x_falloff", "y_profile", "y_origin", "y_falloff", "z_profile", "z_origin", "z_falloff"]},
        {"NAME": "axis_points", "TYPE": "vec4 array", "SIZE": 48, "DESCRIPTION": "by axis, ascending: metres from the eye, density, density per metre to the next", "FROM": ["camera", "points", "x_profile", "x_origin", "x_falloff", "y_profile", "y_origin", "y_falloff", "z_profile", "z_origin", "z_falloff"]},
        {"NAME": "axis_begin", "TYPE": "vec4", "DESCRIPTION": "first point of x, y, z, and how many points", "FROM": ["points"]}
    ],
    "TOLERANCE": {"ABS": 2e-6, "REL": 3e-5, "REFERENCE": 2e-6},
    "CHART": {
        "REFERENCE": {"method": "procedural", "resolution": "32", "steps": 1},
        "CASES": [
            {"NAME": "at the surface", "SET": {"where": "at the surface"}},
            {"NAME": "along the ray", "SET": {"where": "along the ray"}},
            {"NAME": "as a product", "SET": {"where": "as a product"}}
        ],
        "METHODS": [
            {"NAME": "procedural", "SET": {"method": "procedural"}, "CASES": ["at the surface"]},
            {"NAME": "baked", "SET": {"method": "baked"}, "KNOB": "resolution", "VALUES": ["32", "64", "128"], "CASES": ["at the surface"]},
            {"NAME": "march", "SET": {"method": "procedural"}, "KNOB": "steps", "VALUES": [1, 2, 4, 8, 16, 32, 64], "CASES": ["along the ray"]},
            {"NAME": "march, baked", "SET": {"method": "baked"}, "KNOB": "steps", "VALUES": [1, 2, 4, 8, 16, 32, 64], "CASES": ["along the ray"]},
            {"NAME": "closed form", "CASES": ["as a product"]}
        ]
    },
    "BREAKS": [
        "at the surface: fog sticks to geometry and jumps at silhouettes; farther than 4096 cells, and at the sky, the noise counts as its mean.",
        "as a product: not the line integral; against it the median error on random noise axes is 9 %, the worst seen 101 %.",
        "baked: at 4 / 8 / 16 / 32 texels a cell of an octave that octave is off by 12 / 3.3 / .85 / .2 % of its deviation (Perlin) or 31 / 9 / 2.4 / .6 % (simplex)."
    ],
    "STABILITY": [
        {"NAME": "far noise coordinates", "STRESS": {"NAME": "distance from the world's origin", "UNIT": "cells", "RANGE": [1, 1e7], "PER_DECADE": 1},
         "FRAME": {"SCENE": "ground", "EYE": ["10 * $stress", "10 * $stress + 1.6", "-10 * $stress"], "DEPTH": 40, "WIDTH": 15, "HEIGHT": 11}, "SET": {"octaves": 3, "density": 0.05},
         "AUTO": ["method"],
         "HOLDS": {"baked": []}},
        {"NAME": "far noise coordinates along the ray", "STRESS": {"NAME": "distance from the world's origin", "UNIT": "cells", "RANGE": [1, 1e7], "PER_DECADE": 1},
         "FRAME": {"SCENE": "ground", "EYE": ["10 * $stress", "10 * $stress + 1.6", "-10 * $stress"], "DEPTH": 40, "WIDTH": 9, "HEIGHT": 7}, "SET": {"where": "along the ray", "octaves": 2, "steps": 64, "density": 0.05},
         "AUTO": ["method"]},
        {"NAME": "long after the start", "STRESS": {"NAME": "time in a wind of 3 m/s", "UNIT": "s", "RANGE": [1, 1e7], "PER_DECADE": 1},
         "FRAME": {"SCENE": "ground", "TIME": "$stress", "DEPTH": 40, "WIDTH": 15, "HEIGHT": 11}, "SET": {"octaves": 3, "wind": [3, 0, 1], "density": 0.05},
         "AUTO": ["method"],
         "HOLDS": {"baked": []}},
        {"NAME": "optical depth", "STRESS": {"NAME": "optical depth", "RANGE": [1e-9, 1000], "PER_DECADE": 1},
         "SET": {"octaves": 1, "density": "$stress / 100", "color": ["min(65504, 1 / $stress)", "min(65504, 0.1 / $stress)", 0.5], "color_high": ["min(65504, 1 / $stress)", "min(65504, 0.1 / $stress)", 0.5]},
         "AUTO": ["method"],
         "HOLDS": {"baked": [[1e-09, 1e-06], [10, 1000]]}},
        {"NAME": "optical depth along the ray", "STRESS": {"NAME": "optical depth", "RANGE": [1e-9, 1000], "PER_DECADE": 1},
         "FRAME": {"WIDTH": 5, "HEIGHT": 3}, "SET": {"where": "along the ray", "steps": 64, "octaves": 1, "density": "$stress / 100", "color": ["min(65504, 1 / $stress)", "min(65504, 0.1 / $stress)", 0.5], "color_high": ["min(65504, 1 / $stress)", "min(65504, 0.1 / $stress)", 0.5]},
         "AUTO": ["method"]},
        {"NAME": "optical depth of the product", "STRESS": {"NAME": "optical depth", "RANGE": [1e-9, 1000], "PER_DECADE": 1},
         "SET": {"where": "as a product", "octaves": 1, "density": "$stress / 100", "color": ["min(65504, 1 / $stress)", "min(65504, 0.1 / $stress)", 0.5], "method": "procedural"},
         "METHODS": [{"NAME": "product"}]},
        {"NAME": "just behind the start", "STRESS": {"NAME": "behind the start", "UNIT": "ulp", "RANGE": [1, 100000], "PER_DECADE": 1, "VALUES": [-100, -1, 0]},
         "FRAME": {"SCENE": "dome", "DEPTH": "100 + $stress * 0.00000762939453125"}, "SET": {"model": "power", "start": 100, "power_distance": 10, "octaves": 1, "method": "procedural"},
         "METHODS": [{"NAME": "power 1", "SET": {"power_exponent": 1}}, {"NAME": "power 0.55", "SET": {"power_exponent": 0.55}}, {"NAME": "power 0.05", "SET": {"power_exponent": 0.05}}],
         "BREAKS": "power with an exponent below 1 has an infinite slope where the fog starts: there the last bits of the distance show",
         "HOLDS": {"power 0.55": [[-100, -1], [10, 100000]], "power 0.05": [[-100, -1], [100, 100000]]}},
        {"NAME": "power exponent", "STRESS": {"NAME": "falloff exponent", "VALUES": [0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 16], "REFUSED": [-1, 0, 20]},
         "FRAME": {"SCENE": "depths", "WIDTH": 25}, "SET": {"model": "power", "power_exponent": "$stress", "start": 1, "octaves": 1, "method": "procedural"},
         "METHODS": [{"NAME": "power"}]},
        {"NAME": "sun exponent", "STRESS": {"NAME": "lobe exponent", "VALUES": [0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 256], "REFUSED": [-1, 0, 300]},
         "FRAME": {"WIDTH": 13, "HEIGHT": 9, "VIEW": 100}, "SET": {"sun_exponent": "$stress", "sun_color": [1, 0.5, 0.2], "octaves": 1, "method": "procedural"},
         "METHODS": [{"NAME": "sun ahead", "SET": {"sun_direction": [0, 0, -1]}}, {"NAME": "sun overhead", "SET": {"sun_direction": [0, 1, 0]}}, {"NAME": "sun behind", "SET": {"sun_direction": [0, 0, 1]}},
                     {"NAME": "no direction", "SET": {"sun_direction": [0, 0, 0]}}, {"NAME": "offset", "SET": {"sun_direction": [0, 0, -1], "sun_offset": 10}}]},
        {"NAME": "steps along the ray", "STRESS": {"NAME": "steps", "VALUES": [1, 2, 4, 8, 16, 32, 64]},
         "FRAME": {"SCENE": "ground", "DEPTH": 40, "WIDTH": 9, "HEIGHT": 7}, "SET": {"where": "along the ray", "octaves": 2, "density": 0.05, "steps": "$stress"},
         "METHODS": ["procedural"], "AUTO": [],
         "BREAKS": "along the ray: steps longer than a cell of the finest octave alias",
         "HOLDS": {"procedural": [8, 64]}},
        {"NAME": "fine noise, few texels", "STRESS": {"NAME": "texels to a cell of the finest octave", "VALUES": [2, 4, 8, 16, 32]},
         "FRAME": {"SCENE": "ground", "DEPTH": 40, "WIDTH": 15, "HEIGHT": 11}, "SET": {"octaves": 1, "density": 0.05, "resolution": "128", "tile": "128 / $stress"},
         "AUTO": ["method"],
         "HOLDS": {"baked": [16, 32]}},
        {"NAME": "steep profiles of the product", "STRESS": {"NAME": "falloff", "UNIT": "1/m", "RANGE": [1e-4, 100], "PER_DECADE": 1},
         "FRAME": {"SCENE": "ground", "DEPTH": 40, "WIDTH": 15, "HEIGHT": 11}, "SET": {"where": "as a product", "y_profile": "exponential", "y_falloff": "$stress", "x_profile": "constant", "z_profile": "constant", "method": "procedural"},
         "METHODS": [{"NAME": "falling"}, {"NAME": "rising", "SET": {"y_falloff": "-$stress"}}]}
    ]
}*/

// Heterogeneous fog: out = C·T + A·(1 - T).
//   exponential  T = exp(-density·n̂·x)           x = max(0, L - start), L the distance along the ray in m
//   power        1 - T = min(n̂·(x/distance)^exponent, max)                               (P1 eq 10)
//   n̂, the relative density: from the noise n in 0..1 by mode, or (P3) the product of each axis' mean factor
//   A = mix(color, color_high, n), plus the sun's lobe                                    (P1 eqs 5-8)
// n is the noise at (p - wind·t)/size of the surface, or its mean along the ray; its coordinates begin at the eye's
// cell, split from the whole in fp64.
// Limits: L = 0 gives T = 1; sky has the noise's mean and x without end; T = 0 gives A whatever C.

#include "kit/image.glsl"
#include "kit/view.glsl"
#include "common/fog.glsl"
#include "common/sun_offset.glsl"
#include "common/profiles.glsl"
#include "common/noise.glsl"
#include "common/noise_line.glsl"
#include "common/noise_volume.glsl"

const float endless = 1e30;
const float farCells = 4096.0;

NoiseLattice eyeLattice() { return NoiseLattice(ivec3(noise_cell), uint(tile) - 1u, uint(seed)); }

// 1. the noise at p, in cells from the eye's cell
float exactNoise(vec3 p) {
    return noise == noise_perlin ? perlinOctaves(p, eyeLattice(), octaves) : simplexOctaves(p, eyeLattice(), octaves);
}
// 1.1 blurred by Pascal's row 2·smoothing along each axis, a texel a step (P5)
float smoothedNoise(vec3 p) {
    float texel = float(tile) / float(max(resolution, tile)), sum = 0.0;
    vec3 row = smoothing == 1 ? vec3(0.5, 0.25, 0.0) : vec3(0.375, 0.25, 0.0625);
    for (int z = -smoothing; z <= smoothing; z++)
        for (int y = -smoothing; y <= smoothing; y++)
            for (int x = -smoothing; x <= smoothing; x++)
                sum += row[abs(x)] * row[abs(y)] * row[abs(z)] * exactNoise(p + vec3(x, y, z) * texel);
    return sum;
}
float noiseAt(vec3 p) {
    if (method == method_baked) {
        int texels = baked_edge / tile;
        return volumeNoise(baked, p * float(texels), ivec3(noise_cell) * texels);
    }
    return where == where_at_the_surface && smoothing > 0 ? smoothedNoise(p) : exactNoise(p);
}
vec3 cellsAlong(vec3 direction, float L) {
    precise vec3 way = direction * (L * inverse_size);
    if (extent == extent_ground) way.y = 0.0;
    precise vec3 p = noise_fraction + way;
    return p;
}

// 2. the noise of a pixel: at its surface, or its mean along the ray
float surfaceNoise(vec3 direction, float L) {
    return L * inverse_size > farCells ? 0.5 : noiseAt(cellsAlong(direction, L));
}
float rayNoise(vec3 direction, float L) {
    float reach = min(L, range);
    float sum = 0.0;
    for (int k = 0; k < steps; k++)
        sum += noiseAt(cellsAlong(direction, reach * ((float(k) + 0.5) / float(steps))));
    float share = L > range ? range / L : 1.0;
    return 0.5 + share * (sum / float(steps) - 0.5);
}

// 3. relative density of noise n
float modulated(float n, float dy) {
    if (mode == mode_modulate) return low + (high - low) * n;
    if (mode == mode_ocean) return n * (0.5 * dy * dy) + 0.001;
    if (mode == mode_additive) return 1.0 + strength * n;
    return max(1.0 - strength * n, 0.0);
}

// 4. P3's product: each axis' mean factor over the way from the eye to `way` metres along it
float pointsMean(int begin, int end, float way) {
    if (begin == end) return 0.0;
    float a = min(way, 0.0), b = max(way, 0.0), length = b - a;
    if (length < 1e-30) {
        float density = axis_points[begin].y;
        for (int k = begin; k + 1 < end; k++)
            density += axis_points[k].z * (clamp(0.0, axis_points[k].x, axis_points[k + 1].x) - axis_points[k].x);
        return density;
    }
    float sum = max(min(b, axis_points[begin].x) - a, 0.0) * axis_points[begin].y;
    for (int k = begin; k + 1 < end; k++) {
        float from = max(a, axis_points[k].x), to = min(b, axis_points[k + 1].x);
        sum += max(to - from, 0.0) * (axis_points[k].y + axis_points[k].z * (0.5 * (from + to) - axis_points[k].x));
    }
    sum += max(b - max(a, axis_points[end - 1].x), 0.0) * axis_points[end - 1].y;
    return sum / length;
}
// The mean is at most e^60, not only the dense end: or a product would thin out with distance.
float cappedExponentialMean(float logDensity, float k, float way) {
    float beyond = logDensity - k * min(way, 0.0) - 60.0;
    if (beyond > 0.0) return 1.1420073e26 * min(phi(k * abs(way)) * exp(min(beyond, 80.0)), 1.0);
    return exponentialMean(logDensity, k, way);
}
float axisMean(int axis, int profile, float scale, float falloff, float way) {
    float mean = 1.0;
    if (profile == x_profile_exponential) {
        mean = cappedExponentialMean(axis_log[axis], abs(falloff), falloff < 0.0 ? -way : way);
    } else if (profile == x_profile_noise) {
        float cells = way * inverse_size, here = noise_fraction[axis];
        float n = lineOctavesMean(min(here, here + cells), max(here, here + cells), int(noise_cell[axis]), uint(axis), eyeLattice(), octaves);
        mean = low + (high - low) * n;
    } else if (profile != x_profile_constant) {
        mean = pointsMean(int(axis_begin[axis]), int(axis_begin[axis + 1]), way);
    }
    return min(scale * mean, 1e12);
}
float productMean(vec3 direction, float L) {
    vec3 way = direction * min(L, endless);
    return axisMean(0, x_profile, x_density, x_falloff, way.x) * axisMean(1, y_profile, y_density, y_falloff, way.y)
         * axisMean(2, z_profile, z_density, z_falloff, way.z);
}

// 5. airlight: by the noise, and the sun's lobe
vec3 airlightOf(float n, vec3 direction, float L) {
    vec3 airlight = color.rgb + n * (color_high.rgb - color.rgb);
    if (sun_color.rgb == vec3(0.0)) return airlight;
    direction = offsetDirection(direction, L, sun_offset);
    float cosine = dot(direction, to_sun);
    return airlight + sun_color.rgb * (cosine > 0.0 ? pow(cosine, sun_exponent) : 0.0);
}

void main() {
    ivec2 p = pixel();
    vec4 scene = fetch(inputImage, p);
    vec3 ray = rayOf(p);
    vec3 direction = directionOf(ray);
    precise float L = depthAt(p) * rayLength(ray);

    float n = 0.0, relative;
    if (where == where_as_a_product) {
        relative = productMean(direction, L);
    } else {
        n = where == where_along_the_ray ? rayNoise(direction, L) : surfaceNoise(direction, L);
        relative = modulated(n, min(L, 1e15) * direction.y);
    }

    // 6. transmittance and opacity of the model
    float x = min(max(L - start, 0.0), endless);
    vec3 transmittance, opacity;
    if (model == model_exponential) {
        extinctionOf(vec3(density * x * relative), transmittance, opacity);
    } else {
        float u = x * inverse_distance;
        opacity = vec3(relative * (u > 0.0 ? min(pow(u, power_exponent), endless) : 0.0));
        transmittance = vec3(1.0 - min(opacity.x, max_opacity));
    }
    if (opacity.x > max_opacity) {
        opacity = vec3(max_opacity);
        transmittance = vec3(1.0 - max_opacity);
    }
    storeFog(scene, airlightOf(n, direction, L), transmittance, opacity);
}
