// Dual filtering (Bjørge 2015): halve with five bilinear taps, double with eight; twin of dual_filter.hpp. Include
// after blur.glsl. Images of two levels share their
// centre, or all but half a px where the size is odd: so an image of even size, mirrored, gives the mirrored result.
// The effect's DERIVED declares dualOffset, px of the finer image between neighbouring taps.

// Texels are fetched and mixed here, because texture units mix by 8-bit fractions. `at` counts from texel centres.
vec4 bilinear(sampler2D image, vec2 at) {
    vec2 corner = floor(at), f = at - corner;
    ivec2 p = ivec2(corner);
    vec4 above = mix(finiteFetch(image, p), finiteFetch(image, p + ivec2(1, 0)), f.x);
    vec4 below = mix(finiteFetch(image, p + ivec2(0, 1)), finiteFetch(image, p + ivec2(1, 1)), f.x);
    return mix(above, below, f.y);
}

// Px of the finer image that the coarser one reaches beyond its left upper corner: as far as beyond the other, where
// the difference is even.
ivec2 beyond(ivec2 coarse, ivec2 fine) { return (2 * coarse - fine) / 2; }

vec4 halved(sampler2D image, ivec2 p) {
    vec2 at = vec2(2 * p - beyond(passSize, textureSize(image, 0))) + 0.5;
    float d = dualOffset;
    vec4 corners = (bilinear(image, at + vec2(-d, -d)) + bilinear(image, at + vec2(d, -d))) +
                   (bilinear(image, at + vec2(-d, d)) + bilinear(image, at + vec2(d, d)));
    return 0.5 * bilinear(image, at) + 0.125 * corners;
}

vec4 doubled(sampler2D image, ivec2 p) {
    vec2 at = 0.5 * vec2(p + beyond(textureSize(image, 0), passSize)) - 0.25;
    float d = 0.5 * dualOffset;
    vec4 corners = (bilinear(image, at + vec2(-d, -d)) + bilinear(image, at + vec2(d, -d))) +
                   (bilinear(image, at + vec2(-d, d)) + bilinear(image, at + vec2(d, d)));
    vec4 sides = (bilinear(image, at + vec2(-2.0 * d, 0.0)) + bilinear(image, at + vec2(2.0 * d, 0.0))) +
                 (bilinear(image, at + vec2(0.0, -2.0 * d)) + bilinear(image, at + vec2(0.0, 2.0 * d)));
    return (2.0 * corners + sides) / 12.0;
}
