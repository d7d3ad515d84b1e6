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
     "HINT": "visibility at 5 % contrast (meteorological optical range, WMO and CIE), at 2 % (meteorological range), or extinction",
     "WHEN": "$model == $model_exponential || $model == $model_exponential_squared"},
    {"NAME": "visibility", "TYPE": "float", "UNIT": "m", "DEFAULT": 200, "MIN": 0.001, "MAX": 1e7, "UI_MIN": 10,
     "UI_MAX": 5000, "LABEL": "Visibility", "GROUP": "Density",
     "WHEN": "($model == $model_exponential || $model == $model_exponential_squared) && $measure != $measure_extinction"},
    {"NAME": "extinction", "TYPE": "float", "UNIT": "1/m", "DEFAULT": 0.02, "MIN": 0, "MAX": 1000, "UI_MIN": 0,
     "UI_MAX": 0.2, "LABEL": "Extinction", "GROUP": "Density",
     "WHEN": "($model == $model_exponential || $model == $model_exponential_squared) && $measure == $measure_extinction"},
    {"NAME": "tint", "TYPE": "color", "DEFAULT": [1, 1, 1], "MIN": 0, "MAX": 10, "LABEL": "Extinction tint",
     "GROUP": "Density", "HINT": "multiplies the extinction of each channel",
     "WHEN": "$model == $model_exponential || $model == $model_exponential_squared"},
    {"NAME": "color", "TYPE": "color", "DEFAULT": [0.6, 0.65, 0.7], "MIN": 0, "MAX": 65504, "UI_MAX": 2, "AUTO": true,
     "LABEL": "Airlight", "HINT": "the fog's own colour, linear"},
    {"NAME": "max_opacity", "TYPE": "float", "DEFAULT": 1, "MIN": 0, "MAX": 1, "LABEL": "Maximum opacity"},
    {"NAME": "distance_along", "TYPE": "long", "VALUES": [0, 1], "LABELS": ["ray", "planar"], "DEFAULT": 0,
     "LABEL": "Distance", "GROUP": "Distance", "HINT": "planar depth makes fog swim when the camera turns",
     "WHEN": "$model != $model_linear"},
    {"NAME": "start", "TYPE": "float", "UNIT": "m", "DEFAULT": 0, "MIN": 0, "MAX": 1e6, "UI_MAX": 200, "LABEL": "Start",
     "GROUP": "Distance", "HINT": "nearer than this there is no fog",
     "WHEN": "$model != $model_linear"},
    {"NAME": "cutoff", "TYPE": "float", "UNIT": "m", "DEFAULT": 0, "MIN": 0, "MAX": 1e7, "UI_MAX": 5000,
     "LABEL": "Cut-off", "GROUP": "Distance", "HINT": "farther surfaces count as this far; 0: none",
     "WHEN": "$model != $model_linear"},
    {"NAME": "near", "TYPE": "float", "UNIT": "m", "DEFAULT": 0.1, "MIN": 0, "MAX": 1e6, "UI_MAX": 10, "LABEL": "Near",
     "GROUP": "Linear", "HINT": "depth that counts as 0", "WHEN": "$model == $model_linear"},
    {"NAME": "far", "TYPE": "float", "UNIT": "m", "DEFAULT": 1000, "MIN": 0, "MAX": 1e7, "UI_MAX": 2000, "LABEL": "Far",
     "GROUP": "Linear", "HINT": "depth that counts as 1, as does the sky", "WHEN": "$model == $model_linear"},
    {"NAME": "linear_start", "TYPE": "float", "DEFAULT": 0, "MIN": 0, "MAX": 1, "LABEL": "Start (0..1)",
     "GROUP": "Linear", "HINT": "Spirit Fog's FogStart", "WHEN": "$model == $model_linear"},
    {"NAME": "curve", "TYPE": "float", "DEFAULT": 1, "MIN": 0, "MAX": 1000, "UI_MAX": 10, "LABEL": "Curve",
     "GROUP": "Linear", "HINT": "Spirit Fog's FogCurve: opacity per normalised depth",
     "WHEN": "$model == $model_linear"},
    {"NAME": "power_distance", "TYPE": "float", "UNIT": "m", "DEFAULT": 100, "MIN": 0.001, "MAX": 1e7, "UI_MAX": 1000,
     "LABEL": "Blend distance", "GROUP": "Power", "HINT": "opacity reaches 1 this far behind the start",
     "WHEN": "$model == $model_power"},
    {"NAME": "power_exponent", "TYPE": "float", "DEFAULT": 1, "MIN": 0.05, "MAX": 16, "UI_MAX": 4,
     "LABEL": "Falloff exponent", "GROUP": "Power", "HINT": "below 1 the slope at the start is infinite",
     "WHEN": "$model == $model_power"},
    {"NAME": "sun", "TYPE": "long", "VALUES": [0, 1, 2], "LABELS": ["none", "power", "henyey-greenstein"], "DEFAULT": 0,
     "LABEL": "Sun", "GROUP": "Sun", "HINT": "adds light to the airlight towards the sun"},
    {"NAME": "sun_direction", "TYPE": "point3D", "DEFAULT": [0.3, 0.35, -0.9], "MIN": -1, "MAX": 1,
     "LABEL": "Towards the sun", "GROUP": "Sun", "SIDECAR": "lights/directional/direction",
     "HINT": "world, +y up; any length; zero: no sun", "WHEN": "$sun != $sun_none"},
    {"NAME": "sun_color", "TYPE": "color", "DEFAULT": [1, 0.65, 0.28], "MIN": 0, "MAX": 65504, "UI_MAX": 4,
     "LABEL": "Sun colour", "GROUP": "Sun", "WHEN": "$sun != $sun_none"},
    {"NAME": "sun_exponent", "TYPE": "float", "DEFAULT": 8, "MIN": 0.05, "MAX": 256, "UI_MAX": 64,
     "LABEL": "Lobe exponent", "GROUP": "Sun", "WHEN": "$sun == $sun_power"},
    {"NAME": "sun_anisotropy", "TYPE": "float", "DEFAULT": 0.7, "MIN": -0.99, "MAX": 0.99, "LABEL": "Anisotropy g",
     "GROUP": "Sun", "HINT": "mean cosine of scattering", "WHEN": "$sun == $sun_henyey_greenstein"},
    {"NAME": "sun_offset", "TYPE": "float", "UNIT": "m", "DEFAULT": 0, "MIN": 0, "MAX": 1e4, "UI_MAX": 50,
     "LABEL": "Lobe offset", "GROUP": "Sun", "HINT": "Gawron's scalar added to the view vector; 0 is physical",
     "WHEN": "$sun != $sun_none"},
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
  "CHART": {
    "CASES": [
      {"NAME": "exponential", "SET": {"model": "exponential"}},
      {"NAME": "exponential squared", "SET": {"model": "exponential squared"}},
      {"NAME": "linear", "SET": {"model": "linear"}},
      {"NAME": "power", "SET": {"model": "power"}},
      {"NAME": "exponential, sun", "SET": {"model": "exponential", "sun": "henyey-greenstein"}},
      {"NAME": "exponential, encoded mixing", "SET": {"model": "exponential", "mixing": "encoded"}}
    ],
    "METHODS": [{"NAME": "closed form"}],
    "PEERS": [{"NAME": "NumPy", "RUN": "peer_numpy.py", "CASES": ["exponential"]}]
  },
  "BREAKS": [
    "planar distance is wrong in transmittance by up to .24 at the corner of a 110° view",
    "start close to a large distance cancels: at 1 km, 4 ulp of the distance are .25 mm"
  ],
  "STABILITY": [
    {"NAME": "optical depth", "STRESS": {"NAME": "optical depth", "RANGE": [1e-9, 1000], "PER_DECADE": 1},
     "SET": {"measure": "extinction", "extinction": "$stress / 100", "color": ["min(65504, 1 / $stress)", "min(65504, 0.1 / $stress)", 0.5]},
     "METHODS": [{"NAME": "exponential", "SET": {"model": "exponential"}}, {"NAME": "exponential squared", "SET": {"model": "exponential squared"}}]},
    {"NAME": "just behind the start", "STRESS": {"NAME": "behind the start", "UNIT": "ulp", "RANGE": [1, 100000], "PER_DECADE": 1, "VALUES": [-100, -1, 0]},
     "FRAME": {"SCENE": "dome", "DEPTH": "100 + $stress * 0.00000762939453125"},
     "SET": {"start": 100, "power_distance": 10, "visibility": 10, "cutoff": 1000},
     "METHODS": [{"NAME": "exponential", "SET": {"model": "exponential"}},
       {"NAME": "power 1", "SET": {"model": "power", "power_exponent": 1}}, {"NAME": "power 0.55", "SET": {"model": "power", "power_exponent": 0.55}},
       {"NAME": "power 0.25", "SET": {"model": "power", "power_exponent": 0.25}}, {"NAME": "power 0.05", "SET": {"model": "power", "power_exponent": 0.05}}],
     "BREAKS": "power with an exponent below 1 has an infinite slope where the fog starts: there the last bits of the distance show",
     "HOLDS": {"power 0.55": [[-100, -1], [1, 100000]], "power 0.25": [[-100, -1], [100, 100000]], "power 0.05": [[-100, -1], [100, 100000]]}},
    {"NAME": "power exponent", "STRESS": {"NAME": "falloff exponent", "VALUES": [0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 16], "REFUSED": [-1, 0, 20]},
     "FRAME": {"SCENE": "depths", "WIDTH": 25}, "SET": {"model": "power", "power_exponent": "$stress", "start": 1},
     "METHODS": [{"NAME": "power"}]},
    {"NAME": "sun exponent", "STRESS": {"NAME": "lobe exponent", "VALUES": [0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 256], "REFUSED": [-1, 0, 300]},
     "FRAME": {"WIDTH": 13, "HEIGHT": 9, "VIEW": 100}, "SET": {"sun": "power", "sun_exponent": "$stress", "visibility": 100},
     "METHODS": [{"NAME": "sun ahead", "SET": {"sun_direction": [0, 0, -1]}}, {"NAME": "sun overhead", "SET": {"sun_direction": [0, 1, 0]}},
       {"NAME": "sun behind", "SET": {"sun_direction": [0.1, 0.2, 1]}}, {"NAME": "no direction", "SET": {"sun_direction": [0, 0, 0]}}]},
    {"NAME": "forward lobe", "STRESS": {"NAME": "1 - g", "RANGE": [0.01, 1]},
     "FRAME": {"WIDTH": 13, "HEIGHT": 9, "VIEW": 20}, "SET": {"sun": "henyey-greenstein", "visibility": 100, "sun_color": [0.001, 0.01, 0.1]},
     "METHODS": [{"NAME": "forward", "SET": {"sun_direction": [0, 0, -1], "sun_anisotropy": "1 - $stress"}},
       {"NAME": "backward", "SET": {"sun_direction": [0, 0, 1], "sun_anisotropy": "$stress - 1"}}]},
    {"NAME": "depth read from a depth buffer", "STRESS": {"NAME": "depth", "UNIT": "m", "RANGE": [0.1, 1000]},
     "FRAME": {"SCENE": "slope", "DEPTH": "$stress"}, "SET": {"measure": "extinction", "extinction": "1 / $stress"},
     "METHODS": [{"NAME": "16 bits", "FRAME": {"STORED": {"BITS": 16, "NEAR": 0.1, "FAR": 10000}}},
       {"NAME": "16 bits reversed", "FRAME": {"STORED": {"BITS": 16, "NEAR": 0.1, "FAR": 10000, "REVERSED": true}}},
       {"NAME": "24 bits", "FRAME": {"STORED": {"BITS": 24, "NEAR": 0.1, "FAR": 10000}}},
       {"NAME": "24 bits reversed", "FRAME": {"STORED": {"BITS": 24, "NEAR": 0.1, "FAR": 10000, "REVERSED": true}}},
       {"NAME": "32-bit float", "FRAME": {"STORED": {"BITS": 32, "NEAR": 0.1, "FAR": 10000}}},
       {"NAME": "32-bit float reversed", "FRAME": {"STORED": {"BITS": 32, "NEAR": 0.1, "FAR": 10000, "REVERSED": true}}},
       {"NAME": "24 bits infinite", "FRAME": {"STORED": {"BITS": 24, "NEAR": 0.1, "FAR": "infinite"}}},
       {"NAME": "24 bits reversed infinite", "FRAME": {"STORED": {"BITS": 24, "NEAR": 0.1, "FAR": "infinite", "REVERSED": true}}},
       {"NAME": "32-bit float infinite", "FRAME": {"STORED": {"BITS": 32, "NEAR": 0.1, "FAR": "infinite"}}},
       {"NAME": "32-bit float reversed infinite", "FRAME": {"STORED": {"BITS": 32, "NEAR": 0.1, "FAR": "infinite", "REVERSED": true}}}],
     "BREAKS": "a depth buffer of 16 bits steps by Z²/near·2^-16 m, which fog that is dense at that distance shows; reversing it helps floats only",
     "HOLDS": {"16 bits": [0.1, 100], "16 bits reversed": [0.1, 100]}},
    {"NAME": "depth", "STRESS": {"NAME": "depth", "UNIT": "m", "VALUES": [0, 1e-30, 1e-20, 1e-10, 1e-3, 1, 1e3, 1e10, 1e20, 1e30, 1e38, "inf"]},
     "FRAME": {"DEPTH": "$stress"},
     "METHODS": [{"NAME": "exponential", "SET": {"model": "exponential"}}, {"NAME": "exponential squared", "SET": {"model": "exponential squared"}},
       {"NAME": "linear", "SET": {"model": "linear"}}, {"NAME": "power", "SET": {"model": "power"}},
       {"NAME": "with a sun", "SET": {"sun": "power", "sun_offset": 5}}]},
    {"NAME": "brightness", "STRESS": {"NAME": "brightest value of the scene", "VALUES": [1, 1e2, 65504, 1e10, 1e30, "inf", "NaN"]},
     "FRAME": {"WIDTH": 13, "HEIGHT": 9, "PIXEL": "$stress", "DEPTH": 30}, "SET": {"visibility": 10},
     "METHODS": [{"NAME": "linear mixing"}, {"NAME": "encoded mixing", "SET": {"mixing": "encoded"}}]}
  ]
}*/
#include "kit/image.glsl"
#include "kit/view.glsl"
#include "common/sun_offset.glsl"
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
        float power = u > 0.0 ? pow(u, power_exponent) : 0.0;
        opacity = vec3(min(power, max_opacity));
        transmittance = 1.0 - opacity;
        return;
    }
    vec3 opticalDepth = beta * x;
    // from here on a way is endless, and so is its optical depth in any fog
    if (x >= 3.0e38) opticalDepth = mix(vec3(0.0), vec3(1e18), greaterThan(beta, vec3(0.0)));
    if (model == model_exponential_squared) opticalDepth *= opticalDepth;
    opticalDepth = min(opticalDepth, vec3(104.0));
    opacity = opacityOf(opticalDepth);
    transmittance = mix(exp(-opticalDepth), vec3(0.0), greaterThanEqual(opticalDepth, vec3(87.0)));
    bvec3 limited = greaterThan(opacity, vec3(max_opacity));
    transmittance = mix(transmittance, vec3(1.0 - max_opacity), limited);
    opacity = min(opacity, vec3(max_opacity));
}

// 4. Airlight: the fog's colour, and the sun's lobe round its direction.
vec3 airlightOf(vec3 direction, float distance) {
    if (sun == sun_none) return color.rgb;
    direction = offsetDirection(direction, distance, sun_offset);
    if (sun == sun_power) {
        float cosine = dot(direction, toSun);
        return color.rgb + sunLight * (cosine > 0.0 ? pow(cosine, sun_exponent) : 0.0);
    }
    // Henyey-Greenstein by the distance of two unit vectors, which does not cancel in the forward peak.
    // A negative g peaks away from the sun: the same lobe about the opposite direction.
    vec3 apart = direction - (sun_anisotropy < 0.0 ? -toSun : toSun);
    float g = abs(sun_anisotropy);
    float denominator = (1.0 - g) * (1.0 - g) + g * dot(apart, apart);
    return color.rgb + sunLight / (denominator * sqrt(denominator));
}

void main() {
    ivec2 p = pixel();
    vec4 scene = fetch(inputImage, p);
    float planarDepth = depthAt(p);
    vec3 ray = rayOf(p);
    float distance = distance_along == distance_along_ray ? planarDepth * rayLength(ray) : planarDepth;

    vec3 transmittance, opacity;
    fogOf(planarDepth, distance, transmittance, opacity);
    vec3 airlight = airlightOf(directionOf(ray), planarDepth * rayLength(ray));

    // 5. Composite; where nothing of the scene is left, not even infinity shows.
    vec3 left = mix(vec3(0.0), scene.rgb, greaterThan(transmittance, vec3(0.0)));
    vec3 mixed;
    if (mixing == mixing_encoded)
        mixed = decodeSrgb(encodeSrgb(left) * transmittance + encodeSrgb(airlight) * opacity);
    else
        mixed = left * transmittance + airlight * opacity;
    store(vec4(mixed, scene.a));
    storeTransmittance(transmittance);
}
