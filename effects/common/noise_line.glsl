// Gradient noise along one axis, and its mean over a way; twin of noise_line.hpp, which says what it computes. Include
// after common/noise.glsl.

// 1. the slope at a lattice point, uniform in -1..1
float lineSlope(int cell, uint axis, uint mask, uint seed) {
    return float(latticeHash(uvec3(uint(cell) & mask, axis, 0u), seed) >> 8) * 1.1920929e-7 - 1.0;
}

// 2. the noise at f in 0..1 between slopes a and b, -1..1
float lineNoise(float a, float b, float f) {
    float w = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    float low = a * f, high = b * (f - 1.0);
    return 2.0 * (low + w * (high - low));
}

// 3. its mean over f0..f1 inside one cell: of degree 6, so four Gauss points are exact
float lineCellMean(float a, float b, float f0, float f1) {
    float middle = 0.5 * (f0 + f1), reach = 0.5 * (f1 - f0);
    return 0.3260725774 * (lineNoise(a, b, middle - 0.3399810436 * reach) + lineNoise(a, b, middle + 0.3399810436 * reach))
         + 0.1739274226 * (lineNoise(a, b, middle - 0.8611363116 * reach) + lineNoise(a, b, middle + 0.8611363116 * reach));
}

// 4. its mean over x0..x1 ≥ x0: the two cells cut, and between them whole cells, whose integrals 2/7·(a - b) telescope
float lineMean(float x0, float x1, int cell, uint axis, uint mask, uint seed) {
    float way = x1 - x0;
    if (way > 1e6) return 0.0;
    float c0 = floor(x0), c1 = floor(x1);
    int i0 = cell + int(c0), i1 = cell + int(c1);
    float a0 = lineSlope(i0, axis, mask, seed), b0 = lineSlope(i0 + 1, axis, mask, seed);
    if (i0 == i1) return lineCellMean(a0, b0, x0 - c0, x1 - c0);
    float a1 = lineSlope(i1, axis, mask, seed), b1 = lineSlope(i1 + 1, axis, mask, seed);
    float f0 = x0 - c0, f1 = x1 - c1;
    return (lineCellMean(a0, b0, f0, 1.0) * (1.0 - f0) + 0.2857142857 * (b0 - a1) + lineCellMean(a1, b1, 0.0, f1) * f1) / way;
}

// 5. octaves of it, 0..1
float lineOctavesMean(float x0, float x1, int cell, uint axis, NoiseLattice lattice, int octaves) {
    float sum = 0.0, weight = 1.0, scale = 1.0, total = 0.0;
    for (int octave = 0; octave < octaves; octave++) {
        NoiseLattice l = octaveLattice(lattice, octave);
        sum += weight * lineMean(x0 * scale, x1 * scale, cell << octave, axis, l.mask, l.seed);
        total += weight;
        weight *= 0.5;
        scale *= 2.0;
    }
    return 0.5 + 0.5 * (sum / total);
}
