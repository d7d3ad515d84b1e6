#include "noise.hpp"

#include <cmath>

namespace scenes {

uint32_t hash(uint32_t x, uint32_t y, uint32_t seed) {
    uint32_t h = x * 0x8da6b343u ^ y * 0xd8163841u ^ seed * 0xcb1ab31fu;
    h ^= h >> 16;
    h *= 0x7feb352du;
    h ^= h >> 15;
    h *= 0x846ca68bu;
    return h ^ h >> 16;
}

float Random::unit() {
    state_ = hash(state_, 0x9e3779b9u, 1);
    return float(state_ >> 8) / 16777216;
}

Noise gradientNoise(float x, float y, uint32_t seed) {
    const float fx = std::floor(x), fy = std::floor(y);
    const int ix = int(fx), iy = int(fy);
    const float u = x - fx, v = y - fy;
    const auto corner = [&](int cx, int cy, float& gx, float& gy) {
        const uint32_t h = hash(uint32_t(ix + cx), uint32_t(iy + cy), seed);
        gx = float(h & 0xffff) / 32768 - 1;
        gy = float(h >> 16) / 32768 - 1;
        return gx * (u - cx) + gy * (v - cy);
    };
    float gx[4], gy[4];
    const float a = corner(0, 0, gx[0], gy[0]), b = corner(1, 0, gx[1], gy[1]);
    const float c = corner(0, 1, gx[2], gy[2]), d = corner(1, 1, gx[3], gy[3]);
    const auto fade = [](float t) { return t * t * t * (t * (t * 6 - 15) + 10); };
    const auto slope = [](float t) { return 30 * t * t * (t - 1) * (t - 1); };
    const float su = fade(u), sv = fade(v), k = a - b - c + d;
    const auto mixed = [&](const float* g) {
        return g[0] + su * (g[1] - g[0]) + sv * (g[2] - g[0]) + su * sv * (g[0] - g[1] - g[2] + g[3]);
    };
    const float scale = 1.5f;
    return {scale * (a + su * (b - a) + sv * (c - a) + su * sv * k),
            scale * (mixed(gx) + slope(u) * ((b - a) + sv * k)),
            scale * (mixed(gy) + slope(v) * ((c - a) + su * k))};
}

float fractalNoise(float x, float y, int octaves, uint32_t seed) {
    float sum = 0, weight = .5f;
    for (int k = 0; k < octaves; k++) {
        sum += weight * gradientNoise(x, y, seed + k).value;
        weight /= 2;
        const float turned = .8f * x - .6f * y;
        y = 2 * (.6f * x + .8f * y);
        x = 2 * turned;
    }
    return sum;
}

float erodedNoise(float x, float y, int octaves, uint32_t seed) {
    float sum = 0, weight = .5f, dx = 0, dy = 0;
    for (int k = 0; k < octaves; k++) {
        const Noise noise = gradientNoise(x, y, seed + k);
        dx += noise.dx;
        dy += noise.dy;
        sum += weight * noise.value / (1 + .22f * (dx * dx + dy * dy));
        weight /= 2;
        const float turned = .8f * x - .6f * y;
        y = 2 * (.6f * x + .8f * y);
        x = 2 * turned;
    }
    return sum;
}

}  // namespace scenes
