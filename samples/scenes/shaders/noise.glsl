uint mixed(uint h) {
    h ^= h >> 16;
    h *= 0x7feb352du;
    h ^= h >> 15;
    h *= 0x846ca68bu;
    return h ^ (h >> 16);
}

float random(ivec2 cell, uint seed) {
    uint h = uint(cell.x) * 0x8da6b343u ^ uint(cell.y) * 0xd8163841u ^ seed * 0xcb1ab31fu;
    return float(mixed(h) >> 8) / 16777216.;
}

// Value noise in the plane, 0 to 1.
float noise(vec2 p, uint seed) {
    vec2 cell = floor(p), f = p - cell;
    f = f * f * (3. - 2. * f);
    ivec2 i = ivec2(cell);
    return mix(mix(random(i, seed), random(i + ivec2(1, 0), seed), f.x),
               mix(random(i + ivec2(0, 1), seed), random(i + ivec2(1, 1), seed), f.x), f.y);
}

// Octaves finer than two pixels of width `footprint` (in cells of the first) are left out: they only alias.
float fractal(vec2 p, int octaves, float footprint, uint seed) {
    float sum = 0., weight = .5, total = 0.;
    for (int k = 0; k < octaves; k++) {
        float kept = clamp(2. - 4. * footprint, 0., 1.);
        sum += weight * mix(.5, noise(p, seed + uint(k)), kept);
        total += weight;
        weight *= .5;
        footprint *= 2.;
        p = mat2(1.6, 1.2, -1.2, 1.6) * p;
    }
    return sum / total;
}
