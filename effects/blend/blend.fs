/*{
  "DESCRIPTION": "Combines the picture with a second image: mix, add, screen or multiply.",
  "CATEGORIES": ["Utility"],
  "ISFVSN": "2",
  "SPACE": "linear",
  "POINTWISE": true,
  "INPUTS": [
    {"NAME": "inputImage", "TYPE": "image"},
    {"NAME": "second", "TYPE": "image", "DEFAULT": "captured", "LABEL": "Second image",
     "HINT": "the name of an earlier step's output; \"captured\" is the frame as it came"},
    {"NAME": "mode", "TYPE": "long", "VALUES": [0, 1, 2, 3], "LABELS": ["mix", "add", "screen", "multiply"],
     "DEFAULT": 0, "LABEL": "Mode", "HINT": "screen is 1 - (1 - a)(1 - b), and the larger of two values where one exceeds 1"},
    {"NAME": "strength", "TYPE": "float", "DEFAULT": 1, "MIN": 0, "MAX": 16, "UI_MAX": 1, "LABEL": "Strength",
     "HINT": "0 leaves the picture as it is; above 1 only for add"}
  ],
  "TOLERANCE": {"ABS": 1e-6, "REL": 2e-5, "REFERENCE": 2e-6, "MEASURED": 0.09},
  "CHART": {
    "BEFORE": ["depth_fog"],
    "SET": {"strength": 0.5},
    "CASES": [
      {"NAME": "mix", "SET": {"mode": "mix"}}, {"NAME": "add", "SET": {"mode": "add"}},
      {"NAME": "screen", "SET": {"mode": "screen"}}, {"NAME": "multiply", "SET": {"mode": "multiply"}}
    ],
    "METHODS": [{"NAME": "blend"}]
  },
  "BREAKS": ["screen would darken values above 1: the larger of the two is taken there"],
  "STABILITY": [
    {"NAME": "brightness", "STRESS": {"NAME": "brightest value of the picture", "VALUES": [1, 1e2, 65504, 1e10, 1e30, "inf", "NaN"]},
     "FRAME": {"WIDTH": 13, "HEIGHT": 9, "PIXEL": "$stress"},
     "METHODS": [{"NAME": "mix", "SET": {"mode": "mix", "strength": 0.3}}, {"NAME": "add", "SET": {"mode": "add", "strength": 3}},
       {"NAME": "screen", "SET": {"mode": "screen"}}, {"NAME": "multiply", "SET": {"mode": "multiply"}}]}
  ]
}*/
#include "kit/image.glsl"

vec3 screenOf(vec3 a, vec3 b) {
    // 1 - (1 - a)(1 - b) would darken whatever exceeds 1.
    bvec3 bright = greaterThan(max(a, b), vec3(1.0));
    return mix(1.0 - (1.0 - a) * (1.0 - b), max(a, b), bright);
}

void main() {
    ivec2 p = pixel();
    vec4 a = fetch(inputImage, p);
    vec3 b = fetch(second, p).rgb;
    if (strength <= 0.0) {
        store(a);
        return;
    }
    vec3 combined;
    if (mode == mode_add) {
        combined = a.rgb + b * strength;
    } else {
        if (mode == mode_mix) combined = b;
        else if (mode == mode_screen) combined = screenOf(a.rgb, b);
        else combined = a.rgb * b;
        // At full strength nothing of the first image is left, not even infinity. `precise`: some compilers
        // make a + strength (b - a) of it, which is NaN where a is infinite.
        precise vec3 between = a.rgb * (1.0 - strength) + combined * strength;
        if (strength < 1.0) combined = between;
    }
    store(vec4(combined, a.a));
}
