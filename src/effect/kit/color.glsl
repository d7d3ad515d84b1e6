// sRGB's curve, odd and unclipped, for HDR and negative values alike; NaN stays NaN. Twin of encodeSrgb, decodeSrgb in
// math.hpp. Include after kit/image.glsl.

vec3 keepNan(vec3 original, vec3 computed) {
    return mix(computed, original, bvec3(isNan(original.r), isNan(original.g), isNan(original.b)));
}

vec3 encodeSrgb(vec3 linear) {
    vec3 x = abs(linear);
    vec3 curve = 1.055 * pow(max(x, vec3(1e-30)), vec3(1.0 / 2.4)) - 0.055;
    return keepNan(linear, sign(linear) * mix(curve, 12.92 * x, lessThanEqual(x, vec3(0.0031308))));
}

vec3 decodeSrgb(vec3 encoded) {
    vec3 x = abs(encoded);
    vec3 curve = pow((x + 0.055) / 1.055, vec3(2.4));
    return keepNan(encoded, sign(encoded) * mix(curve, x / 12.92, lessThanEqual(x, vec3(0.04045))));
}
