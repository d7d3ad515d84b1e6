/*{
  "DESCRIPTION": "Blur that grows with the fog in front of a surface.",
  "CREDIT": "Gawron and Boryczka 2018",
  "CATEGORIES": ["Blur", "Fog"],
  "ISFVSN": "2",
  "SPACE": "linear",
  "INPUTS": [
    {"NAME": "inputImage", "TYPE": "image"},
    {"NAME": "transmittance", "TYPE": "image", "DEFAULT": "transmittance", "LABEL": "Transmittance",
     "HINT": "of the fog so far; what it hides decides the blur"},
    {"NAME": "clear", "TYPE": "image", "DEFAULT": "captured", "LABEL": "Clear image",
     "HINT": "order: single; the picture before fog"},
    {"NAME": "radius", "TYPE": "float", "UNIT": "px", "DEFAULT": 4, "MIN": 0, "MAX": 64, "UI_MAX": 32,
     "LABEL": "Radius", "HINT": "standard deviation under full fog, in px of the full frame"},
    {"NAME": "start", "TYPE": "float", "DEFAULT": 0, "MIN": 0, "MAX": 0.99, "LABEL": "Start",
     "HINT": "opacity from which on there is blur"},
    {"NAME": "falloff", "TYPE": "float", "DEFAULT": 1, "MIN": 0.25, "MAX": 8, "UI_MAX": 4, "LABEL": "Falloff",
     "HINT": "exponent: above 1 the blur grows late"},
    {"NAME": "order", "TYPE": "long", "VALUES": [0, 1], "LABELS": ["separate", "single"], "DEFAULT": 0, "LABEL": "Order",
     "HINT": "separate: blur the foggy picture; single: as if the clear picture had been blurred before the fog"},
    {"NAME": "edges", "TYPE": "long", "VALUES": [0, 1], "LABELS": ["keep", "bleed"], "DEFAULT": 0, "LABEL": "Edges",
     "HINT": "keep: a surface in thinner fog does not bleed into what lies behind it"},
    {"NAME": "method", "TYPE": "long", "VALUES": [0, 1], "LABELS": ["ladder", "gather"], "AUTO": true, "DEFAULT": "auto",
     "LABEL": "Method", "HINT": "ladder interpolates blurred images; gather weighs each pixel's surroundings by themselves"}
  ],
  "DERIVED": [
    {"NAME": "largestSigma", "TYPE": "float", "FROM": ["radius", "size"]},
    {"NAME": "firstVariance", "TYPE": "float", "FROM": ["radius", "size"]},
    {"NAME": "levelCount", "TYPE": "int", "FROM": ["radius", "size"]},
    {"NAME": "levels", "TYPE": "vec4 array", "SIZE": "$levelCount", "FROM": ["radius", "size"]},
    {"NAME": "levelTables", "TYPE": "vec4 array", "SIZE": "$levelCount", "FROM": ["radius", "size"]},
    {"NAME": "stripWidth", "TYPE": "int", "FROM": ["radius", "size"]},
    {"NAME": "tapCount", "TYPE": "int", "FROM": ["radius", "size"]},
    {"NAME": "levelTaps", "TYPE": "array", "SIZE": "$tapCount", "FROM": ["radius", "size"]},
    {"NAME": "prefilterCount", "TYPE": "int", "FROM": ["radius", "size"]},
    {"NAME": "prefilters", "TYPE": "array", "SIZE": "$prefilterCount", "FROM": ["radius", "size"]},
    {"NAME": "phaseCount", "TYPE": "int", "FROM": ["radius", "size"]},
    {"NAME": "phases", "TYPE": "vec4 array", "SIZE": "$phaseCount", "FROM": ["radius", "size"]},
    {"NAME": "nodeWeights", "TYPE": "vec4 array", "SIZE": "17 * ($levelCount - 1)", "FROM": ["radius", "size"]}
  ],
  "PASSES": [
    {"TARGET": "sharp"},
    {"TARGET": "decimatedRows", "WIDTH": "$stripWidth", "WHEN": "$method == $method_ladder"},
    {"TARGET": "decimatedBoth", "WIDTH": "$stripWidth", "HEIGHT": "$HEIGHT + 8", "WHEN": "$method == $method_ladder"},
    {"TARGET": "blurredRows", "WIDTH": "$stripWidth", "HEIGHT": "$HEIGHT + 8", "WHEN": "$method == $method_ladder"},
    {"TARGET": "blurred", "WIDTH": "$stripWidth", "HEIGHT": "$HEIGHT + 8", "WHEN": "$method == $method_ladder"},
    {}
  ],
  "TOLERANCE": {"ABS": 4e-6, "REL": 6e-5, "REFERENCE": 6e-6,
    "REASON": "weighted sums are divided by their weights, which may be as small as .05; the ladder's own error is stated by the reference"},
  "CHART": {"reference": "reference", "method": "method", "sweep": {"radius": [1, 2, 4, 8, 16, 32]}},
  "BREAKS": [
    "edges: bleed mixes up to half of a near surface into what lies behind its silhouette",
    "the ladder is within .02 of gather where edges bleed; beside silhouettes that are kept, somewhat more",
    "GLSL keeps the ladder in one strip about eight times as wide as the frame: too wide for 4K on some drivers"
  ]
}*/

#include "kit/image.glsl"

float finite(float x) { return isNan(x) ? 0.0 : (isInf(x) ? (x > 0.0 ? 65504.0 : -65504.0) : x); }
vec3 finite3(vec3 c) { return vec3(finite(c.r), finite(c.g), finite(c.b)); }

// 1. Standard deviation of a pixel's blur: grows with the opacity in front of it.
float sigmaAt(ivec2 p) {
    vec3 t = finite3(fetch(transmittance, p).rgb);
    float opacity = 1.0 - (t.r + t.g + t.b) * (1.0 / 3.0);
    float share = clamp((opacity - start) / (1.0 - start), 0.0, 1.0);
    return share > 0.0 ? largestSigma * pow(share, falloff) : 0.0;
}

// 2. What a blur of sigma takes from a pixel: colour times weight, and the weight.
vec4 weighed(ivec2 p, float sigma) {
    vec4 s = fetch(sharp, p);
    float weight = edges == edges_bleed ? 1.0 : (s.a < sigma ? s.a / sigma : 1.0);
    return vec4(s.rgb * weight, weight);
}

// 3. The ladder, level beside level in one strip: levels is sigma, factor, left column, reach; levelTables where its
// taps, prefilter and phases begin, and its width.
int levelAt(int x) {
    int l = 0;
    while (l + 1 < levelCount && x >= int(levels[l + 1].z)) l++;
    return l;
}
int levelHeight(int l) { return (textureSize(sharp, 0).y - 1) / int(leve