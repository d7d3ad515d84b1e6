// Means of density along a way; twin of profiles.hpp, which says what they compute.

// 1. φ(x) = (1 - exp(-x))/x for x ≥ 0: the mean of exp(-t) over 0..x
float phi(float x) {
    float series = 1.0 - x / 2.0 * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0 * (1.0 - x / 6.0 *
                   (1.0 - x / 7.0 * (1.0 - x / 8.0))))));
    return x < 0.5 ? series : (1.0 - exp(-x)) / x;
}

// 2. the mean of exp(logDensity - k·t) over the way from 0 to y, k ≥ 0: its denser end times φ; at most e⁶⁰
float exponentialMean(float logDensity, float k, float y) {
    return exp(min(logDensity - k * min(y, 0.0), 60.0)) * phi(k * abs(y));
}
