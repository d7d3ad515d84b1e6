// Noise baked into a tiling volume; twin of noise_volume.hpp. GPU filters interpolate in 1/256 steps, so texels are
// fetched and interpolated here.

// The volume at q, in texels from the texel `base`; its edge is a power of two and it tiles.
float volumeNoise(sampler3D volume, vec3 q, ivec3 base) {
    int mask = textureSize(volume, 0).x - 1;
    vec3 whole = floor(q);
    vec3 f = q - whole;
    // as its twin's: an integer may not hold what lies beyond
    ivec3 a = (ivec3(clamp(whole, -1073741824.0, 1073741824.0)) + base) & mask;
    ivec3 b = (a + 1) & mask;
    vec4 x0 = vec4(texelFetch(volume, ivec3(a.x, a.y, a.z), 0).r, texelFetch(volume, ivec3(a.x, b.y, a.z), 0).r,
                   texelFetch(volume, ivec3(a.x, a.y, b.z), 0).r, texelFetch(volume, ivec3(a.x, b.y, b.z), 0).r);
    vec4 x1 = vec4(texelFetch(volume, ivec3(b.x, a.y, a.z), 0).r, texelFetch(volume, ivec3(b.x, b.y, a.z), 0).r,
                   texelFetch(volume, ivec3(b.x, a.y, b.z), 0).r, texelFetch(volume, ivec3(b.x, b.y, b.z), 0).r);
    vec4 x = x0 + f.x * (x1 - x0);
    vec2 xy = x.xz + f.y * (x.yw - x.xz);
    return xy.x + f.z * (xy.y - xy.x);
}
