/*{
  "DESCRIPTION": "Homogeneous fog: opacity grows with the distance from the eye.",
  "CREDIT": "Gawron and Boryczka 2018 (power, sun), Spirit Fog (linear), Koschmieder's law (exponential)",
  "CATEGORIES": ["Fog"],
  "ISFVSN": "2",
  "SPACE": "linear",
  "POINTWISE": true,
  "WRITES": ["transmittance"],
  "INPUTS": [
    {"NAME": "inputImage", "TYPE": "image"},
    {"NAME": "model", "TYPE": "long", "VALUES": [0, 1, 2, 3],
     "LABELS": ["exponential", "exponential squared", "linear", "power"], "DEFAULT": 0, "LABEL": "Model",
     "HINT": "exponential is physical; linear is Spirit Fog's; power is Gawron's"},
    {"NAME": "measure", "TYPE": "long", "VALUES": [0, 1, 2],
     "LABELS": ["optical range", "meteorological range", "extinction"], "DEFAULT": 0, "LABEL": "Density given as",
     "GROUP": "Density",
     "HINT": "visibility at 5 % contrast (meteorological optical range, WMO and CIE), at 2 % (meteorological range), or extinction"},
    {"NAME": "visibility", "TYPE": "float", "UNIT": "m", "DEFAULT": 200, "MIN": 0.001, "MAX": 1e7, "UI_MIN": 10,
     "UI_MAX": 5000, "LABEL": "Visibility", "GROUP": "Density", "HINT": "exponential models, unless extinction is given"},
    {"NAME": "extinction", "TYPE": "float", "UNIT": "1/m", "DEFAULT": 0.02, "MIN": 0, "MAX": 1000, "UI_MIN": 0,
     "UI_MAX": 0.2, "LABEL": "Extinction", "GROUP": "Density", "HINT": "exponential models, with measure: extinction"},
    {"NAME": "tint", "TYPE": "color", "DEFAULT": [1, 1, 1], "MIN": 0, "MAX": 10, "LABEL": "Extinction tint",
     "GROUP": "Density", "HINT": "multiplies the extinction of each channel; exponential models"},
    {"NAME": "color", "TYPE": "color", "DEFAULT": [0.6, 0.65, 0.7], "MIN": 0, "MAX": 65504, "UI_MAX": 2, "AUTO": true,
     "LABEL": "Airlight", "HINT": "the fog's own colour, linear"},
    {"NAME": "max_opacity", "TYPE": "float", "DEFAULT": 1, "MIN": 0, "MAX": 1, "LABEL": "Maximum opacity"},
    {"NAME": "distance_along", "TYPE": "long", "VALUES": [0, 1], "LABELS": ["ray", "planar"], "DEFAULT": 0,
     "LABEL": "Distance", "GROUP": "Distance", "HINT": "planar depth makes fog swim when the camera turns"},
    {"NAME": "start", "TYPE": "float", "UNIT": "m", "DEFAULT": 0, "MIN": 0, "MAX": 1e6, "UI_MAX": 200, "LABEL": "Start",
     "GROUP": "Distance", "HINT": "nearer than this there is no fog; not for linear"},
    {"NAME": "cutoff", "TYPE": "float", "UNIT": "m", "DEFAULT": 0, "MIN": 0, "MAX": 1e7, "UI_MAX": 5000,
     "LABEL": "Cut-off", "GROUP": "Distance", "HINT": "farther surfaces count as this far; 0: none"},
    {"NAME": "near", "TYPE": "float", "UNIT": "m", "DEFAULT": 0.1, "MIN": 0, "MAX": 1e6, "UI_MAX": 10, "LABEL": "Near",
     "GROUP": "Linear", "HINT": "depth that counts as 0"},
    {"NAME": "far", "TYPE": "float", "UNIT": "m", "DEFAULT": 1000, "MIN": 0, "MAX": 1e7, "UI_MAX": 2000, "LABEL": "Far",
     "GROUP": "Linear", "HINT": "depth that counts as 1, as does the sky"},
    {"NAME": "linear_start", "TYPE": "float", "DEFAULT": 0, "MIN": 0, "MAX": 1, "LABEL": "Start (0..1)",
     "GROUP": "Linear", "HINT": "Spirit Fog's FogStart"},
    {"NAME": "curve", "TYPE": "float", "DEFAULT": 1, "MIN": 0, "MAX": 1000, "UI_MAX": 10, "LABEL": "Curve",
     "GROUP": "Linear", "HINT": "Spirit Fog's FogCurve: opacity per normalised depth"},
    {"NAME": "power_distance", "TYPE": "float", "UNIT": "m", "DEFAULT": 100, "MIN": 0.001, "MAX": 1e7, "UI_MAX": 1000,
     "LABEL": "Blend distance", "GROUP": "Power", "HINT": "opacity reaches 1 this far behind the start"},
    {"NAME": "power_exponent", "TYPE": "float", "DEFAULT": 1, "MIN": 0.05, "MAX": 16, "UI_MAX": 4,
     "LABEL": "Falloff exponent", "GROUP": "Power", "HINT": "below 1 the slope at the start is infinite"},
    {"NAME": "sun", "TYPE": "long", "VALUES": [0, 1, 2], "LABELS": ["none", "power", "henyey-greenstein"], "DEFAULT": 0,
     "LABEL": "Sun", "GROUP": "Sun", "HINT": "adds light to the airlight towards the sun"},
    {"NAME": "sun_direction", "TYPE": "point3D", "DEFAULT": [0.3, 0.35, -0.9], "MIN": -1, "MAX": 1,
     "LABEL": "Towards the sun", "GROUP": "Sun", "SIDECAR": "lights/directional/direction",
     "HINT": "world, +y up; any length; zero: no sun"},
    {"NAME": "sun_color", "TYPE": "color", "DEFAULT": [1, 0.65, 0.28], "MIN": 0, "MAX": 65504, "UI_MAX": 4,
     "LABEL": "Sun colour", "GROUP": "Sun"},
    {"NAME": "sun_exponent", "TYPE": "float", "DEFAULT": 8, "MIN": 0.05, "MAX": 256, "UI_MAX": 64,
     "LABEL": "Lobe exponent", "GROUP": "Sun", "HINT": "power"},
    {"NAME": "sun_anisotropy", "TYPE": "float", "DEFAULT": 0.7, "MIN": -0.99, "MAX": 0.99, "LABEL": "Anisotropy g",
     "GROUP": "Sun", "HINT": "henyey-greenstein: mean cosine of scattering"},
    {"NAME": "sun_offset", "TYPE": "float", "UNIT": "m", "DEFAULT": 0, "MIN": 0, "MAX": 1e4, "UI_MAX": 50,
     "LABEL": "Lobe offset", "GROUP": "Sun", "HINT": "Gawron's scalar added to the view vector; 0 is physical"},
    {"NAME": "mixing", "TYPE": "long", "VALUES": [0, 1], "LABELS": ["linear", "encoded"], "DEFAULT": 0,
     "LABEL": "Mixing space", "HINT": "encoded: mix sRGB-encoded values, as published fog data sets do"}
  ],
  "DERIVED": [
    {"NAME": "beta", "TYPE": "vec3", "FROM": ["measure", "visibility", "extinction", "tint"]},
    {"NAME": "depthScale", "TYPE": "float", "FROM": ["near", "far"]},
    {"NAME": "inverseDistance", "TYPE": "float", "FROM": ["power_distance"]},
    {"NAME": "toSun", "TYPE": "vec3", "FROM": ["sun_direction"]},
    {"NAME": "sunLight", "TYPE": "vec3", "FROM": ["sun", "sun_color", "sun_direction", "sun_anisotropy"]}
  ],
  "TOLERANCE": {"ABS": 1e-6, "REL": 2e-5, "REFERENCE": 2e-6, "MEASURED": 0.94},
  "BREAKS": [
    "power with an exponent below 1 has an infinite slope where the fog starts: there the last bits of the distance show",
    "planar distance is wrong in transmittance by up to .24 at the corner of a 110° view",
    "start close to a large distance cancels: at 1 km, 4 ulp of the distance are .25 mm"
  ]
}*/

#include "kit/image.glsl"
#include "kit/view.glsl"
#include "kit/color.glsl"

// 1. Distance x travelled in fog, m; finite even for sky.
float fogDistance(float distance) {
    if (cutoff > 0.0) distance = min(distance, cutoff);
    return min(max(distance - start, 0.0), 3.0e38);
}

// 2. Opacity 1 - exp(-τ): GLSL has no expm1, so a series where the difference would cancel.
vec3 opacityOf(vec3 opticalDepth) {
    vec3 t = opticalDepth;
    vec3 series = t * (1.0 - t / 2.0 * (1.0 - t / 3.0 * (1.0 - t / 4.0 * (1.0 - t / 5.0 * (1.0 - t / 6.0 *
                  (1.0 - t / 7.0 * (1.0 - t / 8.0)))))));
    return mix(1.0 - exp(-t), series, lessThan(t, vec3(0.5)));
}

// 3. Opacity and transmittance of the model, per channel.
void fogOf(float planarDepth, float distance, out vec3 transmittance, out vec3 opacity) {
    if (model == model_linear) {
        float l = clamp((planarDepth - near) * depthScale, 0.0, 1.0);
        opacity = vec3(clamp(clamp(l - linear_start, 0.0, 1.0) * curve, 0.0, max_opacity));
        transmittance = 1.0 - opacity;
        return;
    }
    float x = fogDistance(distance);
    if (model == model_power) {
        float u = x * inverseDistance;
        float p