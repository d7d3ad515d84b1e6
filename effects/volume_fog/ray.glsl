// Steps 1 to 5 of volume_fog.fs: the ray, where it meets volumes and lamps, where it may stop, its steps.

const float unreachable = 3.0e38;
const int mostDoublings = 6;  // of the steps between knots of the noise

struct Ray {
    vec3 d;       // unit, world
    vec3 inverse; // 1/d, finite
    float far;    // m to the surface
    float begin;  // m: where fog begins ...
    float stride; // ... and a step of it
    int every;    // steps between knots of the noise
};

struct Step {
    float t0, t1, at, u;  // m, m, m, 0..1
};

// e^-x for x ≥ 0: 0 from 87 on, as on the CPU
float fadeOf(float x) { return x < 87.0 ? exp(-x) : 0.0; }

// 1 - e^-x without cancellation: GLSL has no expm1
float opacityOf(float x) {
    float series = x * (1.0 - x / 2.0 * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0 * (1.0 - x / 6.0 *
                   (1.0 - x / 7.0 * (1.0 - x / 8.0)))))));
    return x < 0.5 ? series : 1.0 - fadeOf(x);
}

// Mean cosine of scattering of a phase function that has one.
float asymmetry() { return phase == phase_henyey_greenstein ? anisotropy : 0.0; }
// 4π·p would be 1 for isotropic scattering; light is given as a white surface shows it, hence π.
float scatteredShare(float versine) {
    const float pi = 3.14159265;
    if (phase == phase_henyey_greenstein) return pi * henyeyGreensteinPhase(abs(anisotropy), versine);
    if (phase == phase_rayleigh) return pi * rayleighPhase(versine);
    return 0.25;
}

// 1.1 a ray parallel to a pair of walls is between them or not: no 0·inf
float inverseOf(float d) { return 1.0 / (abs(d) < 1e-20 ? 1e-20 : d); }

// 1. the ray: unit direction, and how far it goes
Ray castRay(ivec2 p) {
    Ray ray;
    vec3 r = rayOf(p);
    ray.d = directionOf(r);
    ray.inverse = vec3(inverseOf(ray.d.x), inverseOf(ray.d.y), inverseOf(ray.d.z));
    ray.far = min(depthAt(p) * rayLength(r), max_distance);
    return ray;
}

// 2. where the ray is inside volume k; nowhere: (unreachable, 0)
vec2 clipVolume(Ray ray, int k) {
    precise vec3 a = volumes[6 * k].xyz * ray.inverse;
    precise vec3 b = volumes[6 * k + 1].xyz * ray.inverse;
    vec3 near = min(a, b), far = max(a, b);
    float enter = max(max(near.x, near.y), max(near.z, 0.0));
    float leave = min(min(far.x, far.y), min(far.z, ray.far));
    return enter < leave ? vec2(enter, leave) : vec2(unreachable, 0.0);
}

// 2.2 the part of the ray that all volumes lie in
void placeFog(inout Ray ray, int strides) {
    float begin = unreachable, end = 0.0;
    for (int k = 0; k < volume_count; k++) {
        vec2 inside = clipVolume(ray, k);
        begin = min(begin, inside.x);
        end = max(end, inside.y);
    }
    ray.begin = begin < end ? begin : 0.0;
    ray.stride = max((end - ray.begin) * (1.0 / float(strides)), 0.0);
    // 6. Knots of the noise are noise_every steps apart, and on rays below a quarter, an eighth, ... of max_distance
    // twice, four times, ... as many: still fewer metres. A little below, since rays may be of round shares.
    precise float share = 0.485 * max_distance / float(strides) / max(ray.stride, 1e-30);
    ray.every = noise_every << clamp((floatBitsToInt(share) >> 23) - 127, 0, mostDoublings);
}

// 3. how the ray passes lamp k: m to the closest approach, distance² there, and the part within its range
vec4 passLamp(Ray ray, int k) {
    vec4 l = lamps[3 * k];
    precise float along = l.x * ray.d.x + l.y * ray.d.y + l.z * ray.d.z;
    precise vec3 a = l.xyz - along * ray.d;
    precise float apart2 = a.x * a.x + a.y * a.y + a.z * a.z;
    precise float half_ = sqrt(max(l.w * l.w - apart2, 0.0));
    return vec4(along, apart2, along - half_, half_ > 0.0 ? along + half_ : -1.0);
}

vec3 sunTowards(Ray ray) {
    float side = asymmetry() < 0.0 ? -1.0 : 1.0;
    return scatteredShare(versineBetween(ray.d, towards_sun * side)) * (sun_color.rgb * sun_intensity);
}

// 4. optical depth at which what is left cannot show: e^-τ·max(C, A) ≤ 1/26356, an eighth of an 8-bit sRGB step near black.
// log2 by the bits, exact at powers of two and at most .0861 too small between, hence the addition.
float stoppingDepth(Ray ray, vec3 color, vec3 sunlight) {
    if (!early_stop) return unreachable;
    vec3 light = ambient.rgb * ambient_intensity + sunlight;
    for (int k = 0; k < point_lights_count; k++) {
        vec4 passing = passLamp(ray, k);
        if (!(passing.w > 0.0)) continue;
        vec4 c = lamps[3 * k + 2];
        float intensity = lamps[3 * k + 1].w * scatteredShare(0.0) / (c.x + c.y * sqrt(passing.y) + c.z * passing.y);
        light += intensity * lamps[3 * k + 1].rgb;
    }
    int bits = floatBitsToInt(max(max(light.r, light.g), max(light.b, 1e-30)));
    ivec3 scene = floatBitsToInt(color) & 0x7fffffff;  // by bits, so that NaN and inf count as large
    bits = max(max(bits, scene.r), max(scene.g, scene.b));
    precise float log2_ = float(bits) * 1.1920929e-7 - 126.9139;
    return max((log2_ + 14.68585) * 0.69314718, 0.0);
}

// 5. the bounds of step i, and where in it things are sampled
Step placeStep(Ray ray, ivec2 p, int i, float u) {
    Step s;
    s.u = u;
    if (method == method_jittered) {
        uint key = view_seed ^ (uint(FRAMEINDEX) * 0x9e3779b9u);
        s.u = float(int(latticeHash(uvec3(uint(p.x), uint(p.y), uint(i)), key) >> 8)) * 5.9604645e-8;
    }
    precise float t0 = ray.begin + ray.stride * float(i);
    precise float t1 = ray.begin + ray.stride * float(i + 1);
    precise float at = t0 + s.u * (t1 - t0);
    s.t0 = t0;
    s.t1 = t1;
    s.at = at;
    return s;
}
