// Coherent noise on an integer lattice; twin of noise.hpp, which says what it computes and from where.
//
//   NoiseLattice lattice = NoiseLattice(ivec3(cell), uint(period) - 1u, uint(seed));   // cell, fraction: derived
//   float n = perlinOctaves(fraction + d * (L / size), lattice, octaves);              // 0..1

struct NoiseLattice {
    ivec3 cell;
    uint mask;
    uint seed;
};

// 1. the hash of a lattice point, uniform over 32 bits
uint latticeHash(uvec3 p, uint seed) {
    uint h = (p.x * 73856093u) ^ (p.y * 19349663u) ^ (p.z * 83492791u) ^ (seed * 2654435769u);
    h ^= h >> 16;
    h *= 0x7feb352du;
    h ^= h >> 15;
    h *= 0x846ca68bu;
    return h ^ (h >> 16);
}

// 2. the gradient's slope towards d: one of the cube's 12 edges, four of them twice (Perlin 2002)
float latticeSlope(uint hash, vec3 d) {
    uint h = hash & 15u;
    float u = h < 8u ? d.x : d.y;
    float v = h < 4u ? d.y : ((h & 13u) == 12u ? d.x : d.z);
    return ((h & 1u) != 0u ? -u : u) + ((h & 2u) != 0u ? -v : v);
}

// 3. Perlin's gradient noise, quintic fade, scaled by 1/1.0363538 to -1..1
float perlinNoise(vec3 p, NoiseLattice lattice) {
    // 3.1 cell and place in it
    vec3 whole = floor(p);
    vec3 f = p - whole;
    ivec3 cell = ivec3(whole) + lattice.cell;
    uvec3 a = uvec3(cell) & lattice.mask;
    uvec3 b = uvec3(cell + 1) & lattice.mask;
    // 3.2 fade 6t⁵ - 15t⁴ + 10t³
    vec3 w = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    // 3.3 slopes at the corners
    vec3 g = f - 1.0;
    uint s = lattice.seed;
    float n000 = latticeSlope(latticeHash(uvec3(a.x, a.y, a.z), s), vec3(f.x, f.y, f.z));
    float n100 = latticeSlope(latticeHash(uvec3(b.x, a.y, a.z), s), vec3(g.x, f.y, f.z));
    float n010 = latticeSlope(latticeHash(uvec3(a.x, b.y, a.z), s), vec3(f.x, g.y, f.z));
    float n110 = latticeSlope(latticeHash(uvec3(b.x, b.y, a.z), s), vec3(g.x, g.y, f.z));
    float n001 = latticeSlope(latticeHash(uvec3(a.x, a.y, b.z), s), vec3(f.x, f.y, g.z));
    float n101 = latticeSlope(latticeHash(uvec3(b.x, a.y, b.z), s), vec3(g.x, f.y, g.z));
    float n011 = latticeSlope(latticeHash(uvec3(a.x, b.y, b.z), s), vec3(f.x, g.y, g.z));
    float n111 = latticeSlope(latticeHash(uvec3(b.x, b.y, b.z), s), vec3(g.x, g.y, g.z));
    // 3.4 blend
    vec4 nx = vec4(n000, n010, n001, n011) + w.x * (vec4(n100, n110, n101, n111) - vec4(n000, n010, n001, n011));
    vec2 nxy = nx.xz + w.y * (nx.yw - nx.xz);
    return (nxy.x + w.z * (nxy.y - nxy.x)) * 0.9649214;
}

// 4.1 what one lattice point adds: slope·(1/2 - r²)⁴
float simplexPoint(vec3 d, uint hash) {
    float t = max(0.5 - (d.x * d.x + d.y * d.y + d.z * d.z), 0.0);
    t = t * t;
    return t * t * latticeSlope(hash, d);
}

// 4.2 one cubic half of the lattice, seen from its nearest point `cell` at the difference d: that point, and the next
// along the axis of the largest difference; every other point of this half is farther than sqrt(1/2)
float simplexHalf(vec3 d, ivec3 cell, uint mask, uint seed) {
    vec3 a = abs(d);
    ivec3 next = a.x >= a.y && a.x >= a.z ? ivec3(d.x < 0.0 ? -1 : 1, 0, 0)
               : a.y >= a.z               ? ivec3(0, d.y < 0.0 ? -1 : 1, 0)
                                          : ivec3(0, 0, d.z < 0.0 ? -1 : 1);
    return simplexPoint(d, latticeHash(uvec3(cell) & mask, seed))
         + simplexPoint(d - vec3(next), latticeHash(uvec3(cell + next) & mask, seed));
}

// 4. simplex noise: the whole points and the half points, scaled by 1/.01300716 to -1..1
float simplexNoise(vec3 p, NoiseLattice lattice) {
    vec3 below = floor(p);
    vec3 f = p - below;
    ivec3 cell = ivec3(below) + lattice.cell;
    ivec3 up = ivec3(greaterThanEqual(f, vec3(0.5)));
    float whole = simplexHalf(f - vec3(up), cell + up, lattice.mask, lattice.seed);
    float half_ = simplexHalf(f - 0.5, cell, lattice.mask, lattice.seed ^ 0x68e31da4u);
    return (whole + half_) * 76.88073;
}

// 5. the lattice of octave o: cells half as large each time, periods as many metres, a seed of its own
NoiseLattice octaveLattice(NoiseLattice lattice, int octave) {
    return NoiseLattice(lattice.cell << octave, (lattice.mask << octave) | ((1u << octave) - 1u),
                        lattice.seed + uint(octave) * 0x9e3779b9u);
}

// 6. octaves 1, 1/2, 1/4 ... of half the size each, normalised to 0..1
float perlinOctaves(vec3 p, NoiseLattice lattice, int octaves) {
    float sum = 0.0, weight = 1.0, scale = 1.0, total = 0.0;
    for (int octave = 0; octave < octaves; octave++) {
        sum += weight * perlinNoise(p * scale, octaveLattice(lattice, octave));
        total += weight;
        weight *= 0.5;
        scale *= 2.0;
    }
    return 0.5 + 0.5 * (sum / total);
}

float simplexOctaves(vec3 p, NoiseLattice lattice, int octaves) {
    float sum = 0.0, weight = 1.0, scale = 1.0, total = 0.0;
    for (int octave = 0; octave < octaves; octave++) {
        sum += weight * simplexNoise(p * scale, octaveLattice(lattice, octave));
        total += weight;
        weight *= 0.5;
        scale *= 2.0;
    }
    return 0.5 + 0.5 * (sum / total);
}
