/*{
  "DESCRIPTION": "Fog in the whole scene or in boxes, marched along the view ray: falloffs, noise, sun with shadows, lamps.",
  "CREDIT": "Lanman 2018 (density, lights, p2); Henyey and Greenstein 1941; Kulla and Fajardo 2012 (equiangular)",
  "CATEGORIES": ["Fog"],
  "ISFVSN": "2",
  "SPACE": "linear",
  "POINTWISE": true,
  "WRITES": ["transmittance"],
  "INPUTS": [
    {"NAME": "inputImage", "TYPE": "image"},
    {"NAME": "method", "TYPE": "long", "VALUES": [1, 0, 2, 3, 4, 5, 6],
     "LABELS": ["midpoint", "left", "gauss_legendre", "jittered", "equiangular", "shared_noise", "p2"],
     "DEFAULT": "auto", "AUTO": true, "LABEL": "Method", "GROUP": "March",
     "HINT": "equiangular resolves the glow near lamps; jittered trades banding for noise; p2 is Lanman's own sum"},
    {"NAME": "steps", "TYPE": "long", "DEFAULT": 32, "MIN": 1, "MAX": 512, "UI_MAX": 128, "AUTO": true, "LABEL": "Steps",
     "GROUP": "March", "HINT": "samples along the fogged part of each ray"},
    {"NAME": "early_stop", "TYPE": "bool", "DEFAULT": true, "LABEL": "Stop when saturated", "GROUP": "March",
     "HINT": "where what is left cannot change half an 8-bit step",
     "WHEN": "$method != $method_p2"},
    {"NAME": "max_distance", "TYPE": "float", "UNIT": "m", "DEFAULT": 1000, "MIN": 0.01, "MAX": 100000, "UI_MAX": 5000,
     "LABEL": "Farthest fog", "GROUP": "March", "HINT": "along the ray; nothing is in the way beyond, and sky is that far"},
    {"NAME": "density", "TYPE": "float", "UNIT": "1/m", "DEFAULT": 0.01, "MIN": 0, "MAX": 1000, "UI_MAX": 0.1,
     "LABEL": "Extinction", "GROUP": "Whole scene", "HINT": "2.996 over the visibility in m; 0: fog in boxes only"},
    {"NAME": "albedo", "TYPE": "color", "DEFAULT": [1, 1, 1], "MIN": 0, "MAX": 1, "LABEL": "Albedo",
     "GROUP": "Whole scene", "HINT": "share of the light met that is scattered; the rest is absorbed",
     "WHEN": "$density > 0"},
    {"NAME": "height_falloff", "TYPE": "long", "VALUES": [0, 1, 2], "LABELS": ["none", "linear", "exponential"],
     "DEFAULT": 0, "LABEL": "Height falloff", "GROUP": "Whole scene", "WHEN": "$density > 0"},
    {"NAME": "height_start", "TYPE": "float", "UNIT": "m", "DEFAULT": 2, "MIN": -10000, "MAX": 10000, "UI_MIN": -50,
     "UI_MAX": 200, "LABEL": "Falloff from height", "GROUP": "Whole scene", "HINT": "world y",
     "WHEN": "$density > 0 && $height_falloff != $height_falloff_none"},
    {"NAME": "height_distance", "TYPE": "float", "UNIT": "m", "DEFAULT": 20, "MIN": 0, "MAX": 10000, "UI_MAX": 300,
     "LABEL": "Falloff over", "GROUP": "Whole scene",
     "HINT": "linear is gone at its end; exponential has fallen to exp(-7.5) there",
     "WHEN": "$density > 0 && $height_falloff != $height_falloff_none"},
    {"NAME": "boxes", "TYPE": "list", "MAX": 32, "LABEL": "Boxes", "FIELDS": [
      {"NAME": "center", "TYPE": "point3D", "UNIT": "m", "DEFAULT": [0, 5, -20], "MIN": -100000, "MAX": 100000,
       "UI_MIN": -100, "UI_MAX": 100},
      {"NAME": "size", "TYPE": "point3D", "UNIT": "m", "DEFAULT": [20, 10, 20], "MIN": 0, "MAX": 100000, "UI_MAX": 200},
      {"NAME": "density", "TYPE": "float", "UNIT": "1/m", "DEFAULT": 0.1, "MIN": 0, "MAX": 1000, "UI_MAX": 1},
      {"NAME": "albedo", "TYPE": "color", "DEFAULT": [1, 1, 1], "MIN": 0, "MAX": 1},
      {"NAME": "height_falloff", "TYPE": "long", "VALUES": [0, 1, 2], "LABELS": ["none", "linear", "exponential"],
       "DEFAULT": 0},
      {"NAME": "height_start", "TYPE": "float", "UNIT": "m", "DEFAULT": 0, "MIN": 0, "MAX": 100000, "UI_MAX": 100,
       "HINT": "above the box's bottom"},
      {"NAME": "height_distance", "TYPE": "float", "UNIT": "m", "DEFAULT": 10, "MIN": 0, "MAX": 100000, "UI_MAX": 100,
       "HINT": "cut at the box's top"},
      {"NAME": "edge_falloff", "TYPE": "long", "VALUES": [0, 1, 2], "LABELS": ["none", "linear", "exponential"],
       "DEFAULT": 0},
      {"NAME": "edge_start_x", "TYPE": "float", "UNIT": "%", "DEFAULT": 50, "MIN": 0, "MAX": 100,
       "HINT": "of the way from centre to edge"},
      {"NAME": "edge_start_z", "TYPE": "float", "UNIT": "%", "DEFAULT": 50, "MIN": 0, "MAX": 100}]},
    {"NAME": "noise", "TYPE": "long", "VALUES": [0, 1, 2], "LABELS": ["none", "additive", "subtractive"], "DEFAULT": 0,
     "LABEL": "Noise", "GROUP": "Noise", "HINT": "density times 1 + strength·n or 1 - strength·n, n of 0..1"},
    {"NAME": "noise_strength", "TYPE": "float", "DEFAULT": 1, "MIN": 0, "MAX": 1, "LABEL": "Strength", "GROUP": "Noise",
     "WHEN": "$noise != $noise_none"},
    {"NAME": "noise_size", "TYPE": "float", "UNIT": "m", "DEFAULT": 20, "MIN": 0.1, "MAX": 10000, "UI_MAX": 200,
     "LABEL": "Size", "GROUP": "Noise", "HINT": "of a lattice cell",
     "WHEN": "$noise != $noise_none && $noise_strength > 0"},
    {"NAME": "wind", "TYPE": "point3D", "UNIT": "m/s", "DEFAULT": [1, 0, 0], "MIN": -1000, "MAX": 1000, "UI_MIN": -20,
     "UI_MAX": 20, "LABEL": "Wind", "GROUP": "Noise", "WHEN": "$noise != $noise_none && $noise_strength > 0"},
    {"NAME": "noise_seed", "TYPE": "long", "DEFAULT": 0, "MIN": 0, "MAX": 65535, "LABEL": "Seed", "GROUP": "Noise",
     "WHEN": "$noise != $noise_none && $noise_strength > 0"},
    {"NAME": "noise_every", "TYPE": "long", "DEFAULT": 1, "MIN": 1, "MAX": 16, "LABEL": "Look-up every", "UNIT": "steps",
     "GROUP": "Noise",
     "HINT": "a cubic between; twice, four times, ... as many on rays below 1/4, 1/8, ... of the farthest fog; good while under a fifth of a cell",
     "WHEN": "$noise != $noise_none && $noise_strength > 0 && $method != $method_shared_noise && $method != $method_p2"},
    {"NAME": "sun_direction", "TYPE": "point3D", "DEFAULT": [0.3, 0.35, -0.9], "MIN": -1, "MAX": 1,
     "LABEL": "Towards the sun", "GROUP": "Sun", "SIDECAR": "lights/directional/direction", "HINT": "world, +y up; any length",
     "WHEN": "$method != $method_p2 && $sun_intensity > 0"},
    {"NAME": "sun_color", "TYPE": "color", "DEFAULT": [2, 1.8, 1.5], "MIN": 0, "MAX": 65504, "UI_MAX": 8,
     "LABEL": "Sun colour", "GROUP": "Sun", "SIDECAR": "lights/directional/color",
     "HINT": "radiance of a white surface that faces it (irradiance/π)", "WHEN": "$sun_intensity > 0"},
    {"NAME": "sun_intensity", "TYPE": "float", "DEFAULT": 1, "MIN": 0, "MAX": 100, "UI_MAX": 4, "LABEL": "Sun intensity",
     "GROUP": "Sun"},
    {"NAME": "shadow_map", "TYPE": "image", "RESAMPLE": false, "LABEL": "Shadow map", "GROUP": "Sun",
     "SIDECAR": "lights/directional/shadow_map", "HINT": "the sun's depth image, with its matrix in the sidecar"},
    {"NAME": "shadow_strength", "TYPE": "float", "DEFAULT": 1, "MIN": 0, "MAX": 1, "LABEL": "Shadow strength", "GROUP": "Sun",
     "WHEN": "$sun_intensity > 0"},
    {"NAME": "shadow_bias", "TYPE": "float", "UNIT": "m", "DEFAULT": 0.1, "MIN": 0, "MAX": 100, "UI_MAX": 1,
     "LABEL": "Shadow bias", "GROUP": "Sun", "WHEN": "$sun_intensity > 0 && $shadow_strength > 0"},
    {"NAME": "ambient", "TYPE": "color", "DEFAULT": [0.25, 0.3, 0.35], "MIN": 0, "MAX": 65504, "UI_MAX": 2,
     "LABEL": "Ambient", "GROUP": "Light", "SIDECAR": "ambient", "HINT": "radiance arriving evenly from all directions",
     "WHEN": "$ambient_intensity > 0"},
    {"NAME": "ambient_intensity", "TYPE": "float", "DEFAULT": 1, "MIN": 0, "MAX": 100, "UI_MAX": 4,
     "LABEL": "Ambient intensity", "GROUP": "Light", "HINT": "p2: how far its colour replaces the sun's, 0..1"},
    {"NAME": "point_lights", "TYPE": "list", "MAX": 32, "LABEL": "Lamps", "SIDECAR": "lights/point", "FIELDS": [
      {"NAME": "position", "TYPE": "point3D", "UNIT": "m", "DEFAULT": [0, 4, -10], "MIN": -1000000, "MAX": 1000000,
       "UI_MIN": -100, "UI_MAX": 100},
      {"NAME": "color", "TYPE": "color", "DEFAULT": [10, 8, 5], "MIN": 0, "MAX": 65504, "UI_MAX": 100},
      {"NAME": "intensity", "TYPE": "float", "DEFAULT": 1, "MIN": 0, "MAX": 1000, "UI_MAX": 10},
      {"NAME": "range", "TYPE": "float", "UNIT": "m", "DEFAULT": 30, "MIN": 0, "MAX": 100000, "UI_MAX": 200},
      {"NAME": "attenuation", "TYPE": "point3D", "DEFAULT": [1, 0, 1], "MIN": 0, "MAX": 1000, "UI_MAX": 2,
       "HINT": "constant, linear, quadratic in m"}]},
    {"NAME": "phase", "TYPE": "long", "VALUES": [0, 1, 2], "LABELS": ["isotropic", "henyey-greenstein", "rayleigh"],
     "DEFAULT": 0, "LABEL": "Phase function", "GROUP": "Light",
     "WHEN": "$method != $method_p2"},
    {"NAME": "anisotropy", "TYPE": "float", "DEFAULT": 0.5, "MIN": -0.95, "MAX": 0.95, "LABEL": "Anisotropy g",
     "GROUP": "Light", "HINT": "mean cosine of scattering",
     "WHEN": "$method != $method_p2 && $phase == $phase_henyey_greenstein"}
  ],
  "DERIVED": [
    {"NAME": "volume_count", "TYPE": "int", "FROM": ["density", "boxes"]},
    {"NAME": "volumes", "TYPE": "vec4 array", "SIZE": "max(6, $volume_count*6)",
     "FROM": ["camera", "density", "albedo", "height_falloff", "height_start", "height_distance", "boxes"]},
    {"NAME": "lamps", "TYPE": "vec4 array", "SIZE": "max(3, $point_lights_count*3)", "FROM": ["camera", "point_lights"]},
    {"NAME": "towards_sun", "TYPE": "vec3", "FROM": ["sun_direction"]},
    {"NAME": "shadow", "TYPE": "vec4 array", "SIZE": 3, "FROM": ["camera", "sidecar", "shadow_bias"]},
    {"NAME": "noise_cell", "TYPE": "vec3", "FROM": ["camera", "time", "wind", "noise_size"]},
    {"NAME": "noise_fraction", "TYPE": "vec3", "FROM": ["camera", "time", "wind", "noise_size"]}
  ],
  "TOLERANCE": {"ABS": 2e-6, "REL": 3e-5, "REFERENCE": 1e-5,
    "REASON": "against the reference: up to 512 steps are summed in fp32, which was off by 1.1e-5 at 486 (and a bound of that rounding comes on top); GLSL against CPU uses 22 % of its bounds"},
  "CHART": {
    "REFERENCE": {"method": "midpoint", "steps": 4},
    "CASES": [
      {"NAME": "ground fog", "SET": {"density": 0.05, "height_falloff": "exponential", "height_start": 0, "shadow_strength": 0}},
      {"NAME": "sun shafts", "SET": {"density": 0.05, "height_falloff": "exponential", "height_start": 0, "shadow_strength": 1}},
      {"NAME": "box", "SET": {"density": 0, "shadow_strength": 0,
       "boxes": [{"center": [0, 5, -30], "size": [40, 10, 40], "edge_falloff": "linear"}]}},
      {"NAME": "lamps", "SET": {"density": 0.02, "sun_intensity": 0,
       "point_lights": [{"position": [-4, 3, -12]}, {"position": [6, 4, -30], "color": [6, 8, 12]}]}},
      {"NAME": "noise", "SET": {"density": 0.03, "noise": "subtractive", "noise_size": 10, "max_distance": 200, "shadow_strength": 0}}
    ],
    "METHODS": [
      {"NAME": "midpoint", "SET": {"method": "midpoint"}, "KNOB": "steps", "VALUES": [4, 8, 16, 32, 64, 128, 256]},
      {"NAME": "left", "SET": {"method": "left"}, "KNOB": "steps", "VALUES": [4, 8, 16, 32, 64, 128]},
      {"NAME": "Gauss-Legendre", "SET": {"method": "gauss_legendre"}, "KNOB": "steps", "VALUES": [4, 8, 16, 32, 64]},
      {"NAME": "jittered", "SET": {"method": "jittered"}, "KNOB": "steps", "VALUES": [4, 8, 16, 32, 64, 128]},
      {"NAME": "equiangular", "SET": {"method": "equiangular"}, "KNOB": "steps", "VALUES": [4, 8, 16, 32, 64, 128], "CASES": ["lamps"]},
      {"NAME": "shared noise", "SET": {"method": "shared_noise"}, "KNOB": "steps", "VALUES": [4, 8, 16, 32, 64, 128], "CASES": ["noise"]}
    ]
  },
  "BREAKS": [
    "few steps against thin boxes, falloffs or shadows: banding (more steps, or jittered)",
    "midpoint in steps longer than a lamp's distance to the ray loses its glow (equiangular does not)",
    "p2 mixes lights instead of adding them, and darkens thin fog: it multiplies colour by opacity twice"
  ],
  "STABILITY": [
    {"NAME": "lamp near the ray", "STRESS": {"NAME": "distance of the lamp from the ray", "UNIT": "m", "RANGE": [1e-6, 10], "PER_DECADE": 1, "VALUES": [0]},
     "FRAME": {"WIDTH": 5, "HEIGHT": 3, "VIEW": 20, "DEPTH": 40}, "SET": {"density": 0.02, "sun_intensity": 0, "steps": 64, "point_lights": [{"position": ["$stress", 1.6, -20], "color": [0.05, 0.02, 0.1], "attenuation": [0, 0, 1]}]},
     "METHODS": ["left", "midpoint", "gauss_legendre", "jittered", "equiangular"], "AUTO": ["method", "steps"],
     "HOLDS": {"left": [1, 10], "midpoint": [1, 10], "gauss_legendre": [0.1, 10], "jittered": [1, 10]}},
    {"NAME": "lamp near the eye", "STRESS": {"NAME": "distance of the lamp from the eye", "UNIT": "m", "RANGE": [1e-6, 10], "PER_DECADE": 1, "VALUES": [0]},
     "FRAME": {"WIDTH": 5, "HEIGHT": 3, "VIEW": 20, "DEPTH": 40}, "SET": {"density": 0.02, "sun_intensity": 0, "steps": 64, "point_lights": [{"position": [0, "1.6 + $stress", 0], "color": [0.05, 0.02, 0.1], "attenuation": [0, 0, 1]}]},
     "METHODS": ["midpoint", "gauss_legendre", "equiangular"], "AUTO": ["method", "steps"],
     "HOLDS": {"midpoint": [1, 10], "gauss_legendre": [0.1, 10]}},
    {"NAME": "steps in a box", "STRESS": {"NAME": "steps", "VALUES": [1, 2, 4, 8, 16, 32, 64, 128, 256, 512]},
     "FRAME": {"WIDTH": 7, "HEIGHT": 5, "DEPTH": 80}, "SET": {"density": 0, "steps": "$stress", "boxes": [{"center": [3, 2, -30], "size": [14, 8, 20], "density": 0.1, "edge_falloff": "linear"}]},
     "METHODS": ["left", "midpoint", "gauss_legendre", "jittered"], "AUTO": ["method", "steps"],
     "HOLDS": {"left": [128, 512], "midpoint": [8, 512], "gauss_legendre": [8, 512], "jittered": [16, 512]}},
    {"NAME": "optical depth", "STRESS": {"NAME": "optical depth", "RANGE": [1e-9, 1000], "PER_DECADE": 1},
     "FRAME": {"WIDTH": 5, "HEIGHT": 3, "DEPTH": 100}, "SET": {"density": "$stress / 100", "ambient": ["min(65504, 1 / $stress)", "min(65504, 0.1 / $stress)", 0.5], "sun_intensity": 0},
     "METHODS": ["left", "midpoint", "gauss_legendre", "equiangular"], "AUTO": ["method", "steps"]},
    {"NAME": "world offset", "STRESS": {"NAME": "distance from the world's origin", "UNIT": "m", "RANGE": [1, 1e5], "PER_DECADE": 1, "REFUSED": [1e6, 1e7]},
     "FRAME": {"SCENE": "ground", "WIDTH": 9, "HEIGHT": 7, "EYE": ["$stress", 1.6, "40 - $stress"], "DEPTH": 40},
     "SET": {"density": 0, "noise": "subtractive", "noise_size": 10, "steps": 256, "boxes": [{"center": ["$stress", 2, "20 - $stress"], "size": [14, 8, 20], "density": 0.05}]},
     "METHODS": ["midpoint"], "AUTO": ["method", "steps"]},
    {"NAME": "far noise coordinates", "STRESS": {"NAME": "distance from the world's origin", "UNIT": "m", "RANGE": [1, 1e7], "PER_DECADE": 1},
     "FRAME": {"SCENE": "ground", "WIDTH": 9, "HEIGHT": 7, "EYE": ["$stress", "$stress", "-$stress"], "DEPTH": 40},
     "SET": {"density": 0.03, "noise": "subtractive", "noise_size": 1, "steps": 512},
     "METHODS": ["midpoint"], "AUTO": []},
    {"NAME": "thin box", "STRESS": {"NAME": "thickness of the box", "UNIT": "m", "VALUES": [0, 1e-6, 1e-4, 1e-2, 1, 10]},
     "FRAME": {"WIDTH": 7, "HEIGHT": 5, "DEPTH": 80}, "SET": {"density": 0, "boxes": [{"center": [0, 1.6, -30], "size": [14, 8, "$stress"], "density": "min(1000, 1 / max($stress, 1e-9))"}]},
     "BREAKS": "a box only some fp32 steps of its distance thick (10 µm at 30 m) has a thickness of rounding",
     "METHODS": ["midpoint", "gauss_legendre", "equiangular"], "AUTO": ["method", "steps"],
     "HOLDS": {"midpoint": [[0, 0], [0.0001, 10]], "gauss_legendre": [[0, 0], [0.0001, 10]], "equiangular": [[0, 0], [0.0001, 10]], "auto": [[0, 0], [0.0001, 10]]}},
    {"NAME": "ray along a face", "STRESS": {"NAME": "height of the eye over the box's bottom", "UNIT": "m", "VALUES": [-1e-3, -1e-6, 0, 1e-6, 1e-3]},
     "FRAME": {"WIDTH": 7, "HEIGHT": 5, "DEPTH": 80, "EYE": [0, "$stress", 0]}, "SET": {"density": 0, "boxes": [{"center": [0, 4, -30], "size": [14, 8, 20], "density": 0.05}]},
     "METHODS": ["midpoint", "gauss_legendre", "equiangular"], "AUTO": ["method", "steps"]}
  ]
}*/
// in-scattered radiance J and transmittance T of a view ray through absorbing and scattering fog, lit once:
//   out = C·T + J,  T = exp(-τ),  τ = ∫ρ dt,  J = ∫ albedo·ρ·S·exp(-τ(t)) dt,
//   S = ambient + π·p(θ)·sun·(1 - strength·shadow) + Σ π·p(θ)·colour·intensity/(c + l·r + q·r²) within each lamp's range
// Light is not dimmed by fog on its way to the point (as in P2). Symbols, limits and sources: MODELS.md §3, P2 §4.
#include "kit/image.glsl"
#include "kit/view.glsl"
#include "common/noise.glsl"
#include "common/phase.glsl"
#include "ray.glsl"
#include "density.glsl"
#include "light.glsl"
#include "methods.glsl"

void main() {
    ivec2 p = pixel();
    vec4 scene = fetch(inputImage, p);
    Ray ray = castRay(p);
    int strides = method == method_gauss_legendre ? (steps + 3) / 4 : steps;
    placeFog(ray, strides);
    vec3 sunlight = sunTowards(ray);
    float stop = stoppingDepth(ray, scene.rgb, sunlight);
    vec3 scattered;
    float transmittance;
    if (method == method_gauss_legendre)
        marchPanels(ray, p, strides, sunlight, stop, scattered, transmittance);
    else if (method == method_p2)
        marchP2(ray, p, scattered, transmittance);
    else
        marchSteps(ray, p, sunlight, stop, scattered, transmittance);
    // 11. composite; where nothing of the scene is left, not even infinity shows
    vec3 left = transmittance > 0.0 ? scene.rgb * transmittance : vec3(0.0);
    store(vec4(left + scattered, scene.a));
    storeTransmittance(vec3(transmittance));
}
