// Phase functions in 1/sr, normalised over the sphere; twin of phase.hpp, which says what they compute.

const float inverse4Pi = 0.07957747;

// 1. the versine of the angle between two unit vectors
float versineBetween(vec3 d, vec3 s) {
    vec3 x = d - s;
    return 0.5 * (x.x * x.x + x.y * x.y + x.z * x.z);
}

// 2. Henyey-Greenstein; anisotropy g in -1..1, exclusive: (1 - g²)/(4π·((1 - g)² + 2g·v)^1.5)
float henyeyGreensteinPhase(float g, float v) {
    float a = 1.0 - g;
    float b = a * a + 2.0 * g * v;
    return inverse4Pi * (a * (1.0 + g)) / (b * sqrt(b));
}

// 3. Rayleigh: 3/(16π)·(1 + cos²θ)
float rayleighPhase(float v) {
    float c = 1.0 - v;
    return 0.75 * inverse4Pi * (1.0 + c * c);
}
