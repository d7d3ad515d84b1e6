// Steps 6 and 7 of volume_fog.fs: how dense the fog is in a step.

// 6. noise, 0..1, `at` m along the ray
float lookUpNoise(Ray ray, float at) {
    NoiseLattice lattice = NoiseLattice(ivec3(noise_cell), 1023u, uint(noise_seed));
    precise vec3 p = noise_fraction + ray.d * (at * (1.0 / noise_size));
    return 0.5 + 0.5 * simplexNoise(p, lattice);
}

// 6.1 knot j lies where step j·every begins
float lookUpKnot(Ray ray, int j) { return lookUpNoise(ray, ray.begin + ray.stride * float(j * ray.every)); }

// 6.2 the cubic through four knots
float interpolateNoise(Ray ray, int i, float u, vec4 knots) {
    float f = (float(i - i / ray.every * ray.every) + u) * (1.0 / float(ray.every));
    float e = f + 1.0, g = f - 1.0, h = f - 2.0;
    float n = (e * (g * h * knots.y - f * h * knots.z)) * 0.5 +
              (f * g * (e * knots.w - h * knots.x)) * 0.166666667;
    return clamp(n, 0.0, 1.0);
}

// 6.3 noise as this method finds it, as a factor of density; `shared_` and `knots` live from step to step
float placeNoise(Ray ray, Step s, int i, inout float shared_, inout vec4 knots) {
    if (noise == noise_none) return 1.0;
    float n;
    if (method == method_shared_noise) {
        if (i % 2 == 0) shared_ = lookUpNoise(ray, s.t1);
        n = shared_;
    } else if (noise_every > 1 && method != method_gauss_legendre && method != method_p2) {
        if (i == 0)
            knots = vec4(lookUpKnot(ray, -1), lookUpKnot(ray, 0), lookUpKnot(ray, 1), lookUpKnot(ray, 2));
        else if (i % ray.every == 0)
            knots = vec4(knots.yzw, lookUpKnot(ray, i / ray.every + 2));
        n = interpolateNoise(ray, i, s.u, knots);
    } else {
        n = lookUpNoise(ray, s.at);
    }
    return 1.0 + (noise == noise_additive ? noise_strength : -noise_strength) * n;
}

// 7.1 falloffs of volume k at `at` m: u metres beyond each start
float falloffOf(Ray ray, int k, float at) {
    vec4 y = volumes[6 * k + 3], x = volumes[6 * k + 4], z = volumes[6 * k + 5];
    precise float uy = max(ray.d.y * at - y.x, 0.0);
    precise float ux = max(abs(ray.d.x * at - x.x) - x.y, 0.0);
    precise float uz = max(abs(ray.d.z * at - z.x) - z.y, 0.0);
    float linear = max(1.0 - uy * y.y, 0.0) * max(1.0 - ux * x.z, 0.0) * max(1.0 - uz * z.z, 0.0);
    return linear * fadeOf(uy * y.z + ux * x.w + uz * z.w);
}

// 7. optical depth of the step: each volume's density by its overlap with the step, so that a uniform box is exact;
// in a: the depth, in rgb: the albedos weighted by it
vec4 addVolumes(Ray ray, Step s, float noiseFactor) {
    vec4 sum = vec4(0.0);
    for (int k = 0; k < volume_count; k++) {
        vec2 inside = clipVolume(ray, k);
        float from = max(inside.x, s.t0);
        float length_ = max(min(inside.y, s.t1) - from, 0.0);
        float density_ = volumes[6 * k].w * falloffOf(ray, k, from + s.u * length_);
        float depth = length_ * density_ * noiseFactor;
        sum += depth * vec4(volumes[6 * k + 2].rgb, 1.0);
    }
    return sum;
}
