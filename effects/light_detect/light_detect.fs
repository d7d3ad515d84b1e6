/*{
  "DESCRIPTION": "Keeps what is bright enough to be a light, dimmed with distance; black elsewhere.",
  "CREDIT": "Spirit Fog (a ReShade effect)",
  "CATEGORIES": ["Light"],
  "ISFVSN": "2",
  "SPACE": "linear",
  "INPUTS": [
    {"NAME": "inputImage", "TYPE": "image"},
    {"NAME": "luminance", "TYPE": "long", "VALUES": [0, 1], "LABELS": ["encoded 601", "linear 709"], "DEFAULT": 0,
     "LABEL": "Luminance", "HINT": "of sRGB-encoded values, as Spirit Fog measures it, or of linear light"},
    {"NAME": "threshold", "TYPE": "float", "DEFAULT": 0.75, "MIN": 0, "MAX": 65504, "UI_MAX": 1.5, "LABEL": "Threshold",
     "HINT": "a pixel of more luminance is a light"},
    {"NAME": "knee", "TYPE": "float", "DEFAULT": 0, "MIN": 0, "MAX": 100, "UI_MAX": 0.5, "LABEL": "Knee",
     "HINT": "0: a pixel is a light or is not; above, lights fade in this far on both sides of the threshold"},
    {"NAME": "near", "TYPE": "float", "UNIT": "m", "DEFAULT": 0, "MIN": 0, "MAX": 1e6, "UI_MAX": 10, "LABEL": "Near",
     "GROUP": "Distance", "HINT": "lights in front of this depth are left out"},
    {"NAME": "far", "TYPE": "float", "UNIT": "m", "DEFAULT": 0, "MIN": 0, "MAX": 1e7, "UI_MAX": 1000, "LABEL": "Far",
     "GROUP": "Distance", "HINT": "lights behind this depth are left out, and the sky; 0: none is"},
    {"NAME": "attenuation", "TYPE": "float", "UNIT": "1/m", "DEFAULT": 0, "MIN": 0, "MAX": 1000, "UI_MAX": 0.2,
     "LABEL": "Attenuation", "GROUP": "Distance", "HINT": "extinction between the light and the eye"},
    {"NAME": "limit", "TYPE": "float", "DEFAULT": 0, "MIN": 0, "MAX": 65504, "UI_MAX": 16, "LABEL": "Limit",
     "GROUP": "Glow", "HINT": "a light's brightest channel counts as at most this; 0: as captured"},
    {"NAME": "intensity", "TYPE": "float", "DEFAULT": 1, "MIN": 0, "MAX": 100, "UI_MAX": 8, "LABEL": "Intensity",
     "GROUP": "Glow"},
    {"NAME": "saturation", "TYPE": "float", "DEFAULT": 1, "MIN": 0, "MAX": 4, "LABEL": "Saturation", "GROUP": "Glow",
     "HINT": "0 grey, 1 the light's own colour"},
    {"NAME": "curve", "TYPE": "float", "DEFAULT": 1, "MIN": 0.25, "MAX": 8, "UI_MAX": 4, "LABEL": "Curve",
     "GROUP": "Glow", "HINT": "exponent of knee and attenuation: above 1, weak and distant lights matter less",
     "WHEN": "$knee > 0 || $attenuation > 0"},
    {"NAME": "reduction", "TYPE": "long", "VALUES": [1, 2, 4, 8], "LABELS": ["full", "half", "quarter", "eighth"],
     "DEFAULT": 1, "LABEL": "Resolution", "HINT": "each pixel of the result is the mean over its area"}
  ],
  "DERIVED": [
    {"NAME": "rays", "TYPE": "vec4", "FROM": ["camera", "size"]},
    {"NAME": "hardFrom", "TYPE": "vec2", "FROM": ["threshold", "knee"]}
  ],
  "PASSES": [
    {"WIDTH": "max(1, floor($WIDTH / $reduction + .5))", "HEIGHT": "max(1, floor($HEIGHT / $reduction + .5))"}
  ],
  "TOLERANCE": {"ABS": 2e-6, "REL": 3e-5, "REFERENCE": 6e-6,
    "REASON": "a hard threshold is compared only where luminance is more than 2e-6 from it; pow of the sRGB curve and of the curve"},
  "CHART": {
    "CASES": [
      {"NAME": "hard threshold, full size", "SET": {"reduction": "full"}},
      {"NAME": "hard threshold, quarter size", "SET": {"reduction": "quarter"}},
      {"NAME": "soft knee, full size", "SET": {"knee": 0.2, "reduction": "full"}},
      {"NAME": "soft knee, quarter size", "SET": {"knee": 0.2, "reduction": "quarter"}},
      {"NAME": "soft knee, eighth size", "SET": {"knee": 0.2, "reduction": "eighth"}},
      {"NAME": "linear luminance, quarter size", "SET": {"luminance": "linear 709", "reduction": "quarter"}}
    ],
    "METHODS": [{"NAME": "average"}]
  },
  "BREAKS": [
    "a hard threshold flickers as a light's edge moves over pixels: use a knee for sequences",
    "the two luminances disagree on a tenth of all colours",
    "a white wall in sunlight is a light to this effect"
  ],
  "STABILITY": [
    {"NAME": "hard knee", "STRESS": {"NAME": "knee", "VALUES": [0, 1e-8, 1e-6, 1e-4, 1e-2, 0.1, 1, 100]},
     "FRAME": {"SCENE": "depths"}, "SET": {"threshold": 0.5, "knee": "$stress"},
     "METHODS": [{"NAME": "encoded", "SET": {"luminance": "encoded 601"}}, {"NAME": "linear", "SET": {"luminance": "linear 709"}}]},
    {"NAME": "brightness", "STRESS": {"NAME": "brightness of a light", "VALUES": [1, 1e2, 65504, 1e10, 1e30, "inf", "NaN"]},
     "FRAME": {"SCENE": "lamp", "WIDTH": 13, "HEIGHT": 9, "PIXEL": "$stress"}, "SET": {"limit": 1, "knee": 0.1},
     "METHODS": [{"NAME": "encoded", "SET": {"luminance": "encoded 601"}}, {"NAME": "linear", "SET": {"luminance": "linear 709"}}]},
    {"NAME": "curve", "STRESS": {"NAME": "exponent of the curve", "VALUES": [0.25, 0.5, 1, 2, 4, 8], "REFUSED": [-1, 0, 9]},
     "FRAME": {"SCENE": "lamps", "WIDTH": 24, "EXPOSURE": 3}, "SET": {"curve": "$stress", "threshold": 0.02, "knee": 0.01},
     "METHODS": [{"NAME": "encoded", "SET": {"luminance": "encoded 601"}}, {"NAME": "linear", "SET": {"luminance": "linear 709"}}]},
    {"NAME": "attenuation", "STRESS": {"NAME": "optical depth before the light", "RANGE": [1e-9, 1000], "PER_DECADE": 1},
     "FRAME": {"SCENE": "lamps", "WIDTH": 24}, "SET": {"attenuation": "$stress / 100", "threshold": 0.5},
     "METHODS": [{"NAME": "encoded"}]},
    {"NAME": "image size", "STRESS": {"NAME": "width and height", "UNIT": "px", "VALUES": [1, 2, 3, 5, 8, 13]},
     "FRAME": {"SCENE": "lamps", "WIDTH": "$stress", "HEIGHT": "$stress"}, "SET": {"threshold": 0.3},
     "METHODS": [{"NAME": "full"}]}
  ]
}*/
#include "kit/image.glsl"
#include "kit/color.glsl"

// 1. Values that can be averaged: NaN is dark, inf as bright as half floats get.
float finite(float x) { return isNan(x) ? 0.0 : (isInf(x) ? (x > 0.0 ? 65504.0 : -65504.0) : x); }

float luminanceOf(vec3 c) {
    if (luminance == luminance_encoded_601) return dot(encodeSrgb(c), vec3(0.299, 0.587, 0.114));
    return dot(c, vec3(0.2126, 0.7152, 0.0722));
}

// 2. How much of a light it is: 0 or 1, or within a soft knee.
float kneeOf(float b) {
    if (knee == 0.0) return b > threshold ? 1.0 : 0.0;
    float s = clamp(b - hardFrom.x, 0.0, 2.0 * knee);
    return max(s * s * hardFrom.y, b - threshold) / max(b, 1e-6);
}

// 3. What arrives over the distance.
float arriving(ivec2 p) {
    float planar = fetch(depthImage, p).r;
    if (planar < near || (far > 0.0 && planar > far)) return 0.0;
    vec2 ray = (vec2(p) + rays.xy) * rays.zw;
    float distance = min(planar * sqrt(ray.x * ray.x + (ray.y * ray.y + 1.0)), 1e30);
    return exp(-min(attenuation * distance, 87.0));
}

vec4 lightOf(ivec2 p) {
    vec4 scene = fetch(inputImage, p);
    scene = vec4(finite(scene.r), finite(scene.g), finite(scene.b), finite(scene.a));
    float weight = kneeOf(luminanceOf(scene.rgb)) * arriving(p);
    if (!(weight > 0.0)) return vec4(0.0, 0.0, 0.0, scene.a);
    if (curve != 1.0) weight = pow(weight, curve);
    float grey = dot(scene.rgb, vec3(0.2126, 0.7152, 0.0722));
    vec3 light = max(grey + saturation * (scene.rgb - grey), vec3(0.0));
    float brightest = max(max(light.r, light.g), light.b);
    if (limit > 0.0 && brightest > limit) light *= limit / brightest;
    return vec4(light * (weight * intensity), scene.a);
}

// 4. The mean over the pixels of the large image that this one stands for.
void main() {
    ivec2 p = pixel(), size = textureSize(inputImage, 0);
    ivec2 first = p * size / passSize, end = (p + 1) * size / passSize;
    vec4 sum = vec4(0.0);
    for (int y = first.y; y < end.y; y++)
        for (int x = first.x; x < end.x; x++) sum += lightOf(ivec2(x, y));
    store(sum / float((end.x - first.x) * (end.y - first.y)));
}
