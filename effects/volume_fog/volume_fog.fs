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
     "HINT": "where what is left cannot change half an 8-bit step"},
    {"NAME": "max_distance", "TYPE": "float", "UNIT": "m", "DEFAULT": 1000, "MIN": 0.01, "MAX": 100000, "UI_MAX": 5000,
     "LABEL": "Farthest fog", "GROUP": "March", "HINT": "along the ray; nothing is in the way beyond, and sky is that far"},
    {"NAME": "density", "TYPE": "float", "UNIT": "1/m", "DEFAULT": 0.01, "MIN": 0, "MAX": 1000, "UI_MAX": 0.1,
     "LABEL": "Extinction", "GROUP": "Whole scene", "HINT": "2.996 over the visibility in m; 0: fog in boxes only"},
    {"NAME": "albedo", "TYPE": "color", "DEFAULT": [1, 1, 1], "MIN": 0, "MAX": 1, "LABEL": "Albedo",
     "GROUP": "Whole scene", "HINT": "share of the light met that is scattered; the rest is absorbed"},
    {"NAME": "height_falloff", "TYPE": "long", "VALUES": [0, 1, 2], "LABELS": ["none", "linear", "exponential"],
     "DEFAULT": 0, "LABEL": "Height falloff", "GROUP": "Whole scene"},
    {"NAME": "height_start", "TYPE": "float", "UNIT": "m", "DEFAULT": 2, "MIN": -10000, "MAX": 10000, "UI_MIN": -50,
     "UI_MAX": 200, "LABEL": "Falloff from height", "GROUP": "Whole scene", "HINT": "world y"},
    {"NAME": "height_distance", "TYPE": "float", "UNIT": "m", "DEFAULT": 20, "MIN": 0, "MAX": 10000, "UI_MAX": 300,
     "LABEL": "Falloff over", "GROUP": "Whole scene",
     "HINT": "linear is gone at its end; exponential has fallen to exp(-7.5) there"},
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
    {"NAME": "noise_strength", "TYPE": "float", "DEFAULT": 1, "MIN": 0, "MAX": 1, "LABEL": "Strength", "GROUP": "Noise"},
    {"NAME": "noise_size", "TYPE": "float", "UNIT": "m", "DEFAULT": 20, "MIN": 0.1, "MAX": 10000, "UI_MAX": 200,
     "LABEL": "Size", "GROUP": "Noise", "HINT": "of a lattice cell"},
    {"NAME": "wind", "TYPE": "point3D", "UNIT": "m/s", "DEFAULT": [1, 0, 0], "MIN": -1000, "MAX": 1000, "UI_MIN": -20,
     "UI_MAX": 20, "LABEL": "Wind", "GROUP": "Noise"},
    {"NAME": "noise_seed", "TYPE": "long", "DEFAULT": 0, "MIN": 0, "MAX": 65535, "LABEL": "Seed", "GROUP": "Noise"},
    {"NAME": "noise_every", "TYPE": "long", "DEFAULT": 1, "MIN": 1, "MAX": 16, "LABEL": "Look-up every", "UNIT": "steps",
     "GROUP": "Noise", "HINT": "a cubic between; good while that many steps are under a third of a cell"},
    {"NAME": "sun_direction", "TYPE": "point3D", "DEFAULT": [0.3, 0.35, -0.9], "MIN": -1, "MAX": 1,
     "LABEL": "Towards the sun", "GROUP": "Sun", "SIDECAR": "lights/directional/direction", "HINT": "world, +y up; any length"},
    {"NAME": "sun_color", "TYPE": "color", "DEFAULT": [2, 1.8, 1.5], "MIN": 0, "MAX": 65504, "UI_MAX": 8,
     "LABEL": "Sun colour", "GROUP": "Sun", "SIDECAR": "lights/directional/color",
     "HINT": "radiance of a white surface that faces it (irradiance/π)"},
    {"NAME": "sun_intensity", "TYPE": "float", "DEFAULT": 1, "MIN": 0, "MAX": 100, "UI_MAX": 4, "LABEL": "Sun intensity",
     "GROUP": "Sun"},
    {"NAME": "shadow_map", "TYPE": "image", "RESAMPLE": false, "LABEL": "Shadow map", "GROUP": "Sun",
     "SIDECAR": "lights/directional/shadow_map", "HINT": "the sun's depth image, with its matrix in the sidecar"},
    {"NAME": "shadow_strength", "TYPE": "float", "DEFAULT": 1, "MIN": 0, "MAX": 1, "LABEL": "Shadow strength", "GROUP": "Sun"},
    {"NAME": "shadow_bias", "TYPE": "float", "UNIT": "m", "DEFAULT": 0.1, "MIN": 0, "MAX": 100, "UI_MAX": 1,
     "LABEL": "Shadow bias", "GROUP": "Sun"},
    {"NAME": "ambient", "TYPE": "color", "DEFAULT": [0.25, 0.3, 0.35], "MIN": 0, "MAX": 65504, "UI_MAX": 2,
     "LABEL": "Ambient", "GROUP": "Light", "SIDECAR": "ambient", "HINT": "radiance arriving evenly from all directions"},
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
     "DEFAULT": 0, "LABEL": "Phase function", "GROUP": "Light"},
    {"NAME": "anisotropy", "TYPE": "float", "DEFAULT": 0.5, "MIN": -0.95, "MAX": 0.95, "LABEL": "Anisotropy g",
     "GROUP": "Light", "HINT": "henyey-greenstein: mean cosine of scattering"}
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
    "REASON": "against the reference: up to 512 steps are summed in fp32, which was off by 7e-6 at most; GLSL against CPU uses 4 % of its bounds"},
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

const float unreachable = 3.0e38;

struct Ray {
    vec3 d;       // unit, world
    vec3 inverse; // 1/d, finite
    float far;    // m to the surface
    float begin;  // m: where fog begins ...
    float stride; // ... and a step of it
};

struct Step {
    float t0, t1, at, u;  // m, m, m, 0..1
};

// e^-x for x ≥ 0: 0 from 87 on, as on the CPU
float fadeOf(float x) { return x < 87.0 ? exp(-x) : 0.0; }

// 1 - e^-x without cancellation: GLSL has no expm1
float opacityOf(float x) {
    float series = x * (1.0 - x / 2.0 * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0 * (1.0 - x / 6.0 *
                   (1.0 - x / 7.0 * (1.0 - x / 8.0)))))));
    return x < 0.5 ? series : 1.0 - fadeOf(x);
}

// 4π·p would be 1 for isotropic scattering; light is given as a white surface shows it, hence π.
float scatteredShare(float versine) {
    const float pi = 3.14159265;
    if (phase == phase_henyey_greenstein) return pi * henyeyGreensteinPhase(abs(anisotropy), versine);
    if (phase == phase_rayleigh) return pi * rayleighPhase(versine);
    return 0.25;
}

// 1.1 a ray parallel to a pair of walls is between them or not: no 0·inf
float inverseOf(float d) { return 1.0 / (abs(d) < 1e-20 ? 1e-20 : d); }

// 1. the ray: unit direction, and how far it goes
Ray castRay(ivec2 p) {
    Ray ray;
    vec3 r = rayOf(p);
    ray.d = directionOf(r);
    ray.inverse = vec3(inverseOf(ray.d.x), inverseOf(ray.d.y), inverseOf(ray.d.z));
    ray.far = min(depthAt(p) * rayLength(r), max_distance);
    return ray;
}

// 2. where the ray is inside volume k; nowhere: (unreachable, 0)
vec2 clipVolume(Ray ray, int k) {
    precise vec3 a = volumes[6 * k].xyz * ray.inverse;
    precise vec3 b = volumes[6 * k + 1].xyz * ray.inverse;
    vec3 near = min(a, b), far = max(a, b);
    float enter = max(max(near.x, near.y), max(near.z, 0.0));
    float leave = min(min(far.x, far.y), min(far.z, ray.far));
    return enter < leave ? vec2(enter, leave) : vec2(unreachable, 0.0);
}

// 2.2 the part of the ray that all volumes lie in
void placeFog(inout Ray ray, int strides) {
    float begin = unreachable, end = 0.0;
    for (int k = 0; k < volume_count; k++) {
        vec2 inside = clipVolume(ray, k);
        begin = min(begin, inside.x);
        end = max(end, inside.y);
    }
    ray.begin = begin < end ? begin : 0.0;
    ray.stride = max((end - ray.begin) * (1.0 / float(strides)), 0.0);
}

// 3. how the ray passes lamp k: m to the closest approach, distance² there, and the part within its range
vec4 passLamp(Ray ray, int k) {
    vec4 l = lamps[3 * k];
    precise float along = l.x * ray.d.x + l.y * ray.d.y + l.z * ray.d.z;
    precise vec3 a = l.xyz - along * ray.d;
    precise float apart2 = a.x * a.x + a.y * a.y + a.z * a.z;
    precise float half_ = sqrt(max(l.w * l.w - apart2, 0.0));
    return vec4(along, apart2, along - half_, half_ > 0.0 ? along + half_ : -1.0);
}

vec3 sunTowards(Ray ray) {
    float side = anisotropy < 0.0 ? -1.0 : 1.0;
    return scatteredShare(versineBetween(ray.d, towards_sun * side)) * (sun_color.rgb * sun_intensity);
}

// 4. optical depth at which what is left cannot show: e^-τ·max(C, A) ≤ 1/6589, half an 8-bit sRGB step near black.
// log2 by the bits, exact at powers of two and at most .0861 too small between, hence the addition.
float stoppingDepth(Ray ray, vec3 color, vec3 sunlight) {
    if (!early_stop) return unreachable;
    vec3 light = ambient.rgb * ambient_intensity + sunlight;
    for (int k = 0; k < point_lights_count; k++) {
        vec4 passing = passLamp(ray, k);
        if (!(passing.w > 0.0)) continue;
        vec4 c = lamps[3 * k + 2];
        float intensity = lamps[3 * k + 1].w * scatteredShare(0.0) / (c.x + c.y * sqrt(passing.y) + c.z * passing.y);
        light += intensity * lamps[3 * k + 1].rgb;
    }
    int bits = floatBitsToInt(max(max(light.r, light.g), max(light.b, 1e-30)));
    ivec3 scene = floatBitsToInt(color) & 0x7fffffff;  // by bits, so that NaN and inf count as large
    bits = max(max(bits, scene.r), max(scene.g, scene.b));
    precise float log2_ = float(bits) * 1.1920929e-7 - 126.9139;
    return max((log2_ + 12.68585) * 0.69314718, 0.0);
}

// 5. the bounds of step i, and where in it things are sampled
Step placeStep(Ray ray, ivec2 p, int i, float u) {
    Step s;
    s.u = u;
    if (method == method_jittered) {
        uint key = view_seed ^ (uint(FRAMEINDEX) * 0x9e3779b9u);
        s.u = float(int(latticeHash(uvec3(uint(p.x), uint(p.y), uint(i)), key) >> 8)) * 5.9604645e-8;
    }
    precise float t0 = ray.begin + ray.stride * float(i);
    precise float t1 = ray.begin + ray.stride * float(i + 1);
    precise float at = t0 + s.u * (t1 - t0);
    s.t0 = t0;
    s.t1 = t1;
    s.at = at;
    return s;
}

// 6. noise, 0..1, `at` m along the ray
float lookUpNoise(Ray ray, float at) {
    NoiseLattice lattice = NoiseLattice(ivec3(noise_cell), 1023u, uint(noise_seed));
    precise vec3 p = noise_fraction + ray.d * (at * (1.0 / noise_size));
    return 0.5 + 0.5 * simplexNoise(p, lattice);
}

// 6.1 knot j lies where step j·every begins
float lookUpKnot(Ray ray, int j) { return lookUpNoise(ray, ray.begin + ray.stride * float(j * noise_every)); }

// 6.2 the cubic through four knots
float interpolateNoise(int i, float u, vec4 knots) {
    float f = (float(i - i / noise_every * noise_every) + u) * (1.0 / float(noise_every));
    float e = f + 1.0, g = f - 1.0, h = f - 2.0;
    float n = (e * (g * h * knots.y - f * h * knots.z)) * 0.5 +
              (f * g * (e * knots.w - h * knots.x)) * 0.166666667;
    return clamp(n, 0.0, 1.0);
}

// 6.3 noise as this method finds it, as a factor of density; `shared_` and `knots` live from step to step
float placeNoise(Ray ray, Step s, int i, inout float shared_, inout vec4 knots) {
    if (noise == noise_none) return 1.0;
    float n;
    if (method == method_shared_noise) {
        if (i % 2 == 0) shared_ = lookUpNoise(ray, s.t1);
        n = shared_;
    } else if (noise_every > 1 && method != method_gauss_legendre && method != method_p2) {
        if (i == 0)
            knots = vec4(lookUpKnot(ray, -1), lookUpKnot(ray, 0), lookUpKnot(ray, 1), lookUpKnot(ray, 2));
        else if (i % noise_every == 0)
            knots = vec4(knots.yzw, lookUpKnot(ray, i / noise_every + 2));
        n = interpolateNoise(i, s.u, knots);
    } else {
        n = lookUpNoise(ray, s.at);
    }
    return 1.0 + (noise == noise_additive ? noise_strength : -noise_strength) * n;
}

// 7.1 falloffs of volume k at `at` m: u metres beyond each start
float falloffOf(Ray ray, int k, float at) {
    vec4 y = volumes[6 * k + 3], x = volumes[6 * k + 4], z = volumes[6 * k + 5];
    precise float uy = max(ray.d.y * at - y.x, 0.0);
    precise float ux = max(abs(ray.d.x * at - x.x) - x.y, 0.0);
    precise float uz = max(abs(ray.d.z * at - z.x) - z.y, 0.0);
    float linear = max(1.0 - uy * y.y, 0.0) * max(1.0 - ux * x.z, 0.0) * max(1.0 - uz * z.z, 0.0);
    return linear * fadeOf(uy * y.z + ux * x.w + uz * z.w);
}

// 7. optical depth of the step: each volume's density by its overlap with the step, so that a uniform box is exact;
// in a: the depth, in rgb: the albedos weighted by it
vec4 addVolumes(Ray ray, Step s, float noiseFactor) {
    vec4 sum = vec4(0.0);
    for (int k = 0; k < volume_count; k++) {
        vec2 inside = clipVolume(ray, k);
        float from = max(inside.x, s.t0);
        float length_ = max(min(inside.y, s.t1) - from, 0.0);
        float density_ = volumes[6 * k].w * falloffOf(ray, k, from + s.u * length_);
        float depth = length_ * density_ * noiseFactor;
        sum += depth * vec4(volumes[6 * k + 2].rgb, 1.0);
    }
    return sum;
}

// 8. share of sunlight that arrives at `at` m
float shadeStep(Ray ray, float at) {
    bool hasMatrix = any(notEqual(shadow[0].xyz, vec3(0.0)));
    if (!hasMatrix || shadow_strength <= 0.0) return 1.0;
    vec2 size = vec2(textureSize(shadow_map, 0));
    precise float du = shadow[0].x * ray.d.x + shadow[0].y * ray.d.y + shadow[0].z * ray.d.z;
    precise float dv = shadow[1].x * ray.d.x + shadow[1].y * ray.d.y + shadow[1].z * ray.d.z;
    precise float dd = shadow[2].x * ray.d.x + shadow[2].y * ray.d.y + shadow[2].z * ray.d.z;
    precise float u = (shadow[0].w + du * at) * size.x;
    precise float v = (shadow[1].w + dv * at) * size.y;
    precise float d = shadow[2].w + dd * at;
    if (!(u >= 0.0 && u < size.x && v >= 0.0 && v < size.y && d <= 1.0)) return 1.0;
    return d > fetch(shadow_map, ivec2(int(u), int(v))).r ? 1.0 - shadow_strength : 1.0;
}

// 8.1 an angle of 0..π from its sine and cosine times anything positive; GLSL's own atan may be 4096 ulp off
float angleOf(float sine, float cosine) {
    float a = abs(cosine);
    float q = min(sine, a) / max(max(sine, a), 1e-30);
    float t = q / (1.0 + sqrt(1.0 + q * q));
    float s = t * t;
    float arctan = 2.0 * t * (1.0 + s * (-0.333333333 + s * (0.2 + s * (-0.142857143 + s * (0.111111111 +
                   s * (-0.0909090909 + s * (0.0769230769 - s * 0.05)))))));
    float acute = sine > a ? 1.57079633 - arctan : arctan;
    return cosine < 0.0 ? 3.14159265 - acute : acute;
}

// 8.2 light of lamp k: its mean over the part of the step within its range. By midpoint, or (equiangular) with
// 1/(distance² + core²) integrated exactly as the angle it subtends, the rest taken at the angle's middle.
vec3 meanOfLamp(Ray ray, Step s, int k) {
    vec4 passing = passLamp(ray, k), light = lamps[3 * k + 1], c = lamps[3 * k + 2];
    float apart2 = passing.y;
    float from = max(passing.z, s.t0);
    float length_ = max(min(passing.w, s.t1) - from, 0.0);
    if (length_ <= 0.0) return vec3(0.0);
    float a = from - passing.x, b = a + length_;  // m past the closest approach
    float share = light.w / max(s.t1 - s.t0, 1e-30);
    float beyond, mean;
    if (method == method_equiangular) {
        float core2 = apart2 + c.w, core = sqrt(core2);
        float ra = sqrt(core2 + a * a), rb = sqrt(core2 + b * b);
        beyond = (a * rb + b * ra) / (ra + rb);
        float distance2 = apart2 + beyond * beyond;
        float attenuation = c.x + c.y * sqrt(distance2) + c.z * distance2;
        mean = share * (angleOf(core * length_, core2 + a * b) / core) * ((core2 + beyond * beyond) / attenuation);
    } else {
        beyond = a + s.u * length_;
        float distance2 = apart2 + beyond * beyond;
        mean = share * length_ / (c.x + c.y * sqrt(distance2) + c.z * distance2);
    }
    // The versine of the angle to the lamp, without cancellation looking into it.
    float g = anisotropy < 0.0 ? -beyond : beyond;
    float distance_ = max(sqrt(apart2 + g * g), 1e-18);
    float versine = g < 0.0 ? apart2 / (distance_ * (distance_ - g)) : 1.0 + g / distance_;
    return mean * scatteredShare(versine) * light.rgb;
}

vec3 lightStep(Ray ray, Step s, vec3 sunlight) {
    vec3 light = ambient.rgb * ambient_intensity + shadeStep(ray, s.at) * sunlight;
    for (int k = 0; k < point_lights_count; k++) light += meanOfLamp(ray, s, k);
    return light;
}

// 9., 10. one sample a step: S·T·(1 - e^-Δτ), exact for constant S
void marchSteps(Ray ray, ivec2 p, vec3 sunlight, float stop, out vec3 scattered, out float transmittance) {
    float depth = 0.0, through = 1.0, shared_ = 0.0;
    vec4 knots = vec4(0.0);
    scattered = vec3(0.0);
    for (int i = 0; i < steps; i++) {
        Step s = placeStep(ray, p, i, method == method_left ? 0.0 : 0.5);
        vec4 fog = addVolumes(ray, s, placeNoise(ray, s, i, shared_, knots));
        if (fog.a > 0.0) {
            float stepDepth = min(fog.a, stop - depth);
            float weight = through * opacityOf(stepDepth);
            scattered += weight * (fog.rgb * (1.0 / max(fog.a, 1e-30))) * lightStep(ray, s, sunlight);
            through -= weight;
            depth += stepDepth;
        }
        if (depth >= stop) break;
    }
    transmittance = fadeOf(depth);
}

// Gauss-Legendre, four nodes a panel: nodes, weights, and the integrals from 0 to node i of the cubic that is 1 at
// node j and 0 at the others
const vec4 nodeAt = vec4(0.069431844, 0.330009478, 0.669990522, 0.930568156);
const vec4 nodeWeight = vec4(0.173927423, 0.326072577, 0.326072577, 0.173927423);
const mat4 nodeIntegral = mat4(0.086963711, -0.026604180, 0.012627463, -0.003555150,
                               0.188118117, 0.163036289, -0.027880429, 0.006735501,
                               0.167191922, 0.353953006, 0.163036289, -0.014190695,
                               0.177482572, 0.313445115, 0.352676758, 0.086963711);

void marchPanels(Ray ray, ivec2 p, int panels, vec3 sunlight, float stop, out vec3 scattered,
                 out float transmittance) {
    float depth = 0.0, through = 1.0, shared_ = 0.0;
    vec4 knots = vec4(0.0);
    scattered = vec3(0.0);
    for (int i = 0; i < panels && depth < stop; i++) {
        vec4 q;
        vec3 light[4];
        for (int j = 0; j < 4; j++) {
            Step s = placeStep(ray, p, i, nodeAt[j]);
            vec4 fog = addVolumes(ray, s, placeNoise(ray, s, i, shared_, knots));
            q[j] = fog.a;
            light[j] = fog.rgb * (1.0 / max(fog.a, 1e-30)) * lightStep(ray, s, sunlight);
        }
        vec4 before, weight;
        for (int j = 0; j < 4; j++) before[j] = max(dot(nodeIntegral[j], q), 0.0);
        // Only ratios of the weights count: from the nearest node on, they cannot all vanish in dense fog.
        float nearest = min(min(before.x, before.y), min(before.z, before.w));
        for (int j = 0; j < 4; j++) weight[j] = nodeWeight[j] * q[j] * fadeOf(before[j] - nearest);
        // Scaled so that a constant S gives S·(1 - e^-Δτ) exactly.
        float panelDepth = min(dot(nodeWeight, q), stop - depth);
        float whole = through * opacityOf(panelDepth);
        float scale = whole / max(weight.x + weight.y + weight.z + weight.w, 1e-30);
        for (int j = 0; j < 4; j++) scattered += scale * weight[j] * light[j];
        through -= whole;
        depth += panelDepth;
    }
    transmittance = fadeOf(depth);
}

// The report's own march (P2 §4): steps from the eye to the surface, wherever the fog is; densities and colours summed
// without transmittance, lights mixed in turn. Its sum passes 1 behind the saturation distance; here it ends at 1.
void marchP2(Ray ray, ivec2 p, out vec3 scattered, out float transmittance) {
    const float saturation = 2.99573227;  // -ln .05: P2's distance to saturation is this over the extinction
    float shared_ = 0.0;
    vec4 knots = vec4(0.0);
    ray.begin = 0.0;
    ray.stride = ray.far * (1.0 / float(steps));
    scattered = vec3(0.0);
    transmittance = 1.0;
    for (int i = 0; i < steps; i++) {
        Step s = placeStep(ray, p, i, 0.0);
        float noiseFactor = placeNoise(ray, s, i, shared_, knots);
        float density_ = 0.0;
        for (int k = 0; k < volume_count; k++) {
            vec2 inside = clipVolume(ray, k);
            if (s.at >= inside.x && s.at < inside.y)
                density_ += volumes[6 * k].w * (1.0 / saturation) * (ray.stride * falloffOf(ray, k, s.at) * noiseFactor);
        }
        vec3 light = sun_color.rgb * sun_intensity * shadeStep(ray, s.at);
        light += clamp(ambient_intensity, 0.0, 1.0) * (ambient.rgb - light);
        for (int k = 0; k < point_lights_count; k++) {
            vec4 passing = passLamp(ray, k), lamp = lamps[3 * k + 1], c = lamps[3 * k + 2];
            float beyond = s.at - passing.x;
            precise float distance2 = passing.y + beyond * beyond;
            float range = lamps[3 * k].w;
            if (distance2 < range * range)
                light += clamp(lamp.w / (c.x + c.y * sqrt(distance2) + c.z * distance2), 0.0, 1.0) * (lamp.rgb - light);
        }
        density_ = min(density_, transmittance);
        scattered += density_ * light;
        transmittance -= density_;
    }
    scattered *= 1.0 - transmittance;
}

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
