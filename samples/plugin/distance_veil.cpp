// distance_veil: a veil of light that thickens with distance.
//
//   out = C + V·(1 - 2^(-L/h))    L distance along the view ray in m, h halving distance in m, V the veil's
//   light
//
// At L = 0 the picture is unchanged; sky (L = inf) has the whole veil.
#include <cmath>
#include <opencv2/core/utility.hpp>

#include "effect/kit/math.hpp"
#include "effect/plugin.hpp"

namespace {

using namespace brume;

struct DistanceVeil {
    float halving;
    cv::Vec3f color;
};

// --- the CPU half: fp32, any number of threads --------------------------------------------------

// 1. How much of the veil lies before a surface.
BRUME_INLINE float veilBefore(float distance, float halving) { return 1.0f - exp2Fast(-distance / halving); }

BRUME_VECTORISE void veilRow(const DistanceVeil& p, const View& view, int j, const cv::Vec4f* in,
                             const float* depth, cv::Vec4f* out) {
    for (int i = 0; i < view.width; i++) {
        // 2. Planar depth becomes distance along the view ray.
        float distance = depth[i] * View::rayLength(view.rayX(i), view.rayY(j));
        // 3. The veil only adds light; alpha passes.
        float veil = veilBefore(distance, p.halving);
        out[i] = {in[i][0] + p.color[0] * veil, in[i][1] + p.color[1] * veil, in[i][2] + p.color[2] * veil,
                  in[i][3]};
    }
}

void run(const DistanceVeil& p, const CpuContext& c) {
    cv::Mat output = c.output;
    cv::parallel_for_(cv::Range(0, output.rows), [&](const cv::Range& rows) {
        for (int j = rows.start; j < rows.end; j++)
            veilRow(p, c.view, j, c.input.ptr<cv::Vec4f>(j), c.depth.ptr<float>(j), output.ptr<cv::Vec4f>(j));
    });
}

// --- the reference: fp64, one pixel, slow and obvious -------------------------------------------

ReferencePixel reference(const DistanceVeil& p, const ReferenceContext& c, cv::Point at) {
    cv::Vec3d ray = c.camera.ray(at.x, at.y);
    double distance = double(c.depth.at<float>(at)) * cv::norm(ray);
    double veil = -std::expm1(-std::log(2.) * distance / p.halving);
    cv::Vec4f scene = c.input.at<cv::Vec4f>(at);
    ReferencePixel pixel;
    for (int n = 0; n < 3; n++) {
        pixel.color[n] = scene[n] + p.color[n] * veil;
        // What a relative error refers to: the largest number that went in.
        pixel.scale = std::max({pixel.scale, double(std::abs(scene[n])), double(p.color[n])});
    }
    pixel.color[3] = scene[3];
    return pixel;
}

}  // namespace

BRUME_PLUGIN(EffectOf<DistanceVeil>()
                 .bind("halving", &DistanceVeil::halving)
                 .bind("color", &DistanceVeil::color)
                 .run(run)
                 .reference(reference))
