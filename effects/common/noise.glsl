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

// 4.1 what a lattice point's slope is multiplied by: (1/2 - r²)⁴ within its reach
float simplexReach(float t) {
    t = max(t, 0.0);
    t = t * t;
    return t * t;
}

float simplexSlope(ivec3 cell, uint mask, uint seed, vec3 d) {
    return latticeSlope(latticeHash(uvec3(cell) & mask, seed), d);
}

// 4. simplex noise: the whole points and the half points, scaled by 1/.01300716 to -1..1. Four points are within reach:
// the nearest corner, the corner across the axis along which the place is nearest to the cell's middle, the cell's
// centre, and the next one along the axis of the largest distance from it. With u = |f - 1/2| along each axis, their
// 1/2 - r² are s + Σu - 3/4, that - 2·min u, s = 1/2 - Σu², s + 2·max u - 1. (Where the choice of an axis is open, what
// is chosen adds nothing.)
float simplexNoise(vec3 p, NoiseLattice lattice) {
    vec3 below = floor(p);
    vec3 d = (p - below) - 0.5;
    ivec3 cell = ivec3(below) + lattice.cell;
    vec3 u = abs(d);
    float least = min(min(u.x, u.y), u.z), most = max(max(u.x, u.y), u.z);
    float s = 0.5 - (u.x * u.x + u.y * u.y + u.z * u.z);
    float c = s + ((u.x + u.y + u.z) - 0.75);
    // 4.2 the axes chosen, and towards which side the place is
    ivec3 side = ivec3(d.x < 0.0 ? -1 : 1, d.y < 0.0 ? -1 : 1, d.z < 0.0 ? -1 : 1);
    ivec3 across = u.x <= least ? ivec3(side.x, 0, 0) : u.y <= least ? ivec3(0, side.y, 0) : ivec3(0, 0, side.z);
    ivec3 beyond = u.x >= most ? ivec3(side.x, 0, 0) : u.y >= most ? ivec3(0, side.y, 0) : ivec3(0, 0, side.z);
    // 4.3 their slopes
    ivec3 corner = cell + (side + 1) / 2;
    vec3 fromCorner = d - 0.5 * vec3(side);
    uint halfSeed = lattice.seed ^ 0x68e31da4u;
    float whole = simplexReach(c) * simplexSlope(corner, lattice.mask, lattice.seed, fromCorner)
                + simplexReach(c - (least + least))
                    * simplexSlope(corner - across, lattice.mask, lattice.seed, fromCorner + vec3(across));
    float half_ = simplexReach(s) * simplexSlope(cell, lattice.mask, halfSeed, d)
                + simplexReach(s + ((most + most) - 1.0))
                    * simplexSlope(cell + beyond, lattice.mask, halfSeed, d - vec3(beyond));
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
