/*{
  "DESCRIPTION": "Shows depth as colours: near is warm, far is cool, sky is white.",
  "CATEGORIES": ["Utility"],
  "ISFVSN": "2",
  "SPACE": "linear",
  "POINTWISE": true,
  "INPUTS": [
    {"NAME": "inputImage", "TYPE": "image"},
    {"NAME": "palette", "TYPE": "long", "VALUES": [0, 1], "LABELS": ["spectrum", "grey"], "DEFAULT": 0, "LABEL": "Palette"},
    {"NAME": "nearest", "TYPE": "float", "UNIT": "m", "DEFAULT": 0.5, "MIN": 0.001, "MAX": 1e6, "UI_MAX": 10,
     "LABEL": "Nearest", "HINT": "the palette's near end"},
    {"NAME": "farthest", "TYPE": "float", "UNIT": "m", "DEFAULT": 500, "MIN": 0.001, "MAX": 1e6, "UI_MAX": 2000,
     "LABEL": "Farthest", "HINT": "the palette's far end; steps between are logarithmic"},
    {"NAME": "strength", "TYPE": "float", "DEFAULT": 1, "MIN": 0, "MAX": 1, "LABEL": "Strength",
     "HINT": "0 shows the picture, 1 only the depth"}
  ],
  "DERIVED": [
    {"NAME": "logNearest", "TYPE": "float", "FROM": ["nearest"]},
    {"NAME": "inverseOctaves", "TYPE": "float", "FROM": ["nearest", "farthest"]}
  ],
  "TOLERANCE": {"ABS": 2e-6, "REL": 2e-5, "REFERENCE": 2e-6, "MEASURED": 0.31,
                "REASON": "GLSL's log2 may be off by 2e-6 absolute where it crosses 0, as on Mesa"},
  "CHART": {
    "CASES": [
      {"NAME": "spectrum", "SET": {"palette": "spectrum"}},
      {"NAME": "grey", "SET": {"palette": "grey"}}
    ],
    "METHODS": [{"NAME": "palette"}]
  },
  "STABILITY": [
    {"NAME": "depth", "STRESS": {"NAME": "depth", "UNIT": "m", "VALUES": [0, 1e-30, 1e-3, 1, 1e3, 1e10, 1e30, "inf"]},
     "FRAME": {"DEPTH": "$stress"}},
    {"NAME": "narrow palette", "STRESS": {"NAME": "farthest over nearest, less 1", "VALUES": [0, 1e-6, 1e-4, 1e-2, 1, 100]},
     "FRAME": {"SCENE": "depths", "WIDTH": 25}, "SET": {"nearest": 10, "farthest": "10 * (1 + $stress)"}}
  ]
}*/
#include "kit/image.glsl"
#include "kit/view.glsl"

// 1. Place on the logarithmic scale, 0 near to 1 far.
float placeOf(float planarDepth) {
    if (planarDepth <= 0.0) return 0.0;
    return clamp((log2(planarDepth) - logNearest) * inverseOctaves, 0.0, 1.0);
}

// 2. Colour of a place: five stops, red, yellow, green, blue, violet, joined by straight lines.
vec3 paletteColor(float place) {
    if (palette == palette_grey) return vec3(1.0 - place);
    const vec3 stops[5] = vec3[](vec3(0.85, 0.10, 0.05), vec3(0.85, 0.65, 0.05), vec3(0.10, 0.55, 0.20),
                                 vec3(0.05, 0.20, 0.75), vec3(0.15, 0.03, 0.30));
    float scaled = place * 4.0;
    int stop = min(int(scaled), 3);
    return mix(stops[stop], stops[stop + 1], scaled - float(stop));
}

void main() {
    ivec2 p = pixel();
    vec4 scene = fetch(inputImage, p);
    float planarDepth = depthAt(p);
    vec3 shown = isInf(planarDepth) ? vec3(1.0) : paletteColor(placeOf(planarDepth));
    // 3. Strength 1 hides the scene altogether, infinities too. `precise`: some compilers make
    // scene + strength (shown - scene) of it, which is NaN where the scene is infinite.
    vec3 left = strength < 1.0 ? scene.rgb * (1.0 - strength) : vec3(0.0);
    precise vec3 result = left + shown * strength;
    store(vec4(result, scene.a));
}
