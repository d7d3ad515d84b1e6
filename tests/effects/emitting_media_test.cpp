// Layered and boxed fogs against a renderer of absorbing and emitting media, written for this test from the
// equation of transfer alone, dI/ds = σ·(E - I): it shares no code with the effects or their references.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>

#include "apply/apply.hpp"
#include "effects/fog_fixture.hpp"
#include "gl/gl_runner.hpp"

namespace brume {
namespace {

// What a medium does at a place: extinction per channel in 1/m, and the radiance it tends to.
struct Medium {
    cv::Vec3d extinction, source;
};
using MediumAt = std::function<Medium(const cv::Vec3d& place)>;

// Opacity and gained light of a stretch of even medium put before what lies behind it.
struct Seen {
    cv::Vec3d through{1, 1, 1}, gained{};
    void add(const Medium& m, double way) {
        for (int n = 0; n < 3; n++) {
            const double opacity = -std::expm1(-m.extinction[n] * way);
            gained[n] += through[n] * opacity * m.source[n];
            through[n] *= 1 - opacity;
        }
    }
};

// The ray of a pixel, straight from the pinhole: per metre of planar depth, not normalised.
cv::Vec3d rayOf(const Camera& c, int column, int row) {
    const cv::Vec4d view((column + .5 - c.cx) / c.fx, (c.cy - row - .5) / c.fy, -1, 0);
    const cv::Vec4d world = c.worldFromCamera * view;
    return {world[0], world[1], world[2]};
}

// A scene to fog: a floor, columns at several depths, sky; colours in patches.
FramePair scene(double eyeHeight, double pitch) {
    FramePair frame = fogFrame({64, 36});
    frame.camera = Camera::withHorizontalView({64, 36}, 70);
    turn(frame.camera, 20, pitch);
    frame.camera.worldFromCamera(1, 3) = eyeHeight;
    for (int j = 0; j < 36; j++)
        for (int i = 0; i < 64; i++) {
            const cv::Vec3d ray = rayOf(frame.camera, i, j);
            double depth = ray[1] < 0 ? eyeHeight / -ray[1] : std::numeric_limits<double>::infinity();
            if (i / 4 % 3 == 0 && j > 7) depth = std::min(depth, 6. + 4 * (i / 4));
            frame.depth.at<float>(j, i) = float(depth);
            frame.color.at<cv::Vec4f>(j, i) =
                cv::Vec4f(.1f + .1f * float(i / 8), .05f * float(j / 4), .2f + .3f * float(i / 4 % 2), 1);
        }
    return frame;
}

// Small even stretches, halved until halving changes nothing that shows: second order in their length.
// Nothing is left of the medium above `top`.
cv::Mat marched(const FramePair& frame, const MediumAt& at, double top) {
    cv::Mat image = frame.color.clone();
    for (int j = 0; j < image.rows; j++)
        for (int i = 0; i < image.cols; i++) {
            const cv::Vec3d ray = rayOf(frame.camera, i, j), eye = frame.camera.eye();
            const double scale = cv::norm(ray), up = ray[1] / scale,
                         end = up > 0 ? std::max(0., top - eye[1]) / up : 1e4,
                         far = std::min({double(frame.depth.at<float>(j, i)) * scale, end, 1e4});
            auto colour = [&](int steps) {
                Seen seen;
                for (int k = 0; k < steps; k++)
                    seen.add(at(eye + ray * ((k + .5) * far / steps / scale)), far / steps);
                cv::Vec3d sum = seen.gained;
                for (int n = 0; n < 3; n++)
                    sum[n] += seen.through[n] * double(frame.color.at<cv::Vec4f>(j, i)[n]);
                return sum;
            };
            int steps = 64;
            cv::Vec3d last = colour(steps), next = colour(steps *= 2);
            while (cv::norm(last - next) > 1e-5 && steps < 1 << 20) last = next, next = colour(steps *= 2);
            for (int n = 0; n < 3; n++) image.at<cv::Vec4f>(j, i)[n] = float(next[n]);
        }
    return image;
}

struct EmittingBox {
    cv::Vec3d center, size;
    double extinction;
    cv::Vec3d albedo;
};

// Even boxes: exact, from wall to wall.
cv::Mat fromWallToWall(const FramePair& frame, const std::vector<EmittingBox>& boxes,
                       const cv::Vec3d& ambient) {
    cv::Mat image = frame.color.clone();
    for (int j = 0; j < image.rows; j++)
        for (int i = 0; i < image.cols; i++) {
            const cv::Vec3d ray = rayOf(frame.camera, i, j), eye = frame.camera.eye();
            const double depth = frame.depth.at<float>(j, i);  // also the ray's parameter
            std::vector<double> walls = {0, std::min(depth, 1e4)};
            for (const EmittingBox& b : boxes)
                for (int axis = 0; axis < 3; axis++)
                    for (int side : {-1, 1}) {
                        const double t = (b.center[axis] + side * b.size[axis] / 2 - eye[axis]) / ray[axis];
                        if (t > 0 && t < walls[1]) walls.push_back(t);
                    }
            std::sort(walls.begin(), walls.end());
            Seen seen;
            for (size_t k = 0; k + 1 < walls.size(); k++) {
                const cv::Vec3d place = eye + ray * (.5 * (walls[k] + walls[k + 1]));
                double extinction = 0;
                cv::Vec3d scattered;
                for (const EmittingBox& b : boxes) {
                    bool isInside = true;
                    for (int axis = 0; axis < 3; axis++)
                        isInside &= std::abs(place[axis] - b.center[axis]) < b.size[axis] / 2;
                    if (isInside) extinction += b.extinction, scattered += b.albedo * b.extinction;
                }
                if (extinction > 0)
                    seen.add({{extinction, extinction, extinction}, (scattered / extinction).mul(ambient)},
                             (walls[k + 1] - walls[k]) * cv::norm(ray));
            }
            for (int n = 0; n < 3; n++)
                image.at<cv::Vec4f>(j, i)[n] =
                    float(seen.gained[n] + seen.through[n] * double(frame.color.at<cv::Vec4f>(j, i)[n]));
        }
    return image;
}

// Of R, G, B clipped to 0..1, in dB.
double psnr(const cv::Mat& a, const cv::Mat& b) {
    double sum = 0;
    for (int j = 0; j < a.rows; j++)
        for (int i = 0; i < a.cols; i++)
            for (int n = 0; n < 3; n++) {
                const double d = std::clamp(double(a.at<cv::Vec4f>(j, i)[n]), 0., 1.) -
                                 std::clamp(double(b.at<cv::Vec4f>(j, i)[n]), 0., 1.);
                sum += d * d;
            }
    return -10 * std::log10(std::max(sum / (3. * double(a.total())), 1e-30));
}

// Measured: layers 117 to 122 dB, the ramp 136; boxes 125 by midpoint, 100 by Gauss-Legendre, whose panels
// straddle walls.
void expectSame(const FramePair& frame, const std::string& step, const cv::Mat& rendered, double decibels) {
    EXPECT_GE(psnr(runFog(frame, step).images.at("color"), rendered), decibels) << "CPU " << step;
    static const auto gl = makeGlRunner();
    const Chain chain = parsePreset("{\"effects\": [" + step + "]}", "test", EffectRegistry::standard());
    const cv::Mat glsl = gl->run(planChain(chain, frame, Backend::Gl, {}), frame, {}).images.at("color");
    EXPECT_GE(psnr(glsl, rendered), decibels) << "GLSL " << step;
    EXPECT_LT(psnr(frame.color, rendered), 25) << "the fog hardly shows: " << step;
}

TEST(EmittingMedia, LayersOfColouredDensity) {
    for (auto [eye, pitch] : {std::pair(1.6, 0.), std::pair(25., -30.), std::pair(4., 15.)}) {
        const FramePair frame = scene(eye, pitch);
        auto at = [](const cv::Vec3d& p) {
            const double low = .05 * std::exp(-.15 * (p[1] - 2)), high = .03 * std::exp(-.4 * (p[1] - 6));
            return Medium{cv::Vec3d(1, .8, .6) * low + cv::Vec3d(.5, .7, 1) * high, {.6, .65, .7}};
        };
        expectSame(frame,
                   R"({"effect": "height_fog", "color": [0.6, 0.65, 0.7, 1], "method": "closed form",
                       "density": 0.05, "height": 2, "falloff": 0.15, "tint": [1, 0.8, 0.6, 1],
                       "density2": 0.03, "height2": 6, "falloff2": 0.4, "tint2": [0.5, 0.7, 1, 1]})",
                   marched(frame, at, 80), 110);
    }
}

TEST(EmittingMedia, RampOfDensity) {
    const FramePair frame = scene(3, 5);
    auto at = [](const cv::Vec3d& p) {
        const double rho = p[1] < 2 ? .08 : p[1] < 6 ? .08 * (6 - p[1]) / 4 : 0;
        return Medium{{rho, rho, rho}, {.6, .65, .7}};
    };
    expectSame(
        frame,
        R"({"effect": "height_fog", "color": [0.6, 0.65, 0.7, 1], "profile": "ramp", "method": "closed form"})",
        marched(frame, at, 7), 110);
}

TEST(EmittingMedia, BoxesThatOverlap) {
    const std::vector<EmittingBox> boxes = {{{0, 3, -20}, {20, 6, 20}, .08, {1, .8, .6}},
                                            {{5, 2, -25}, {16, 8, 30}, .05, {.4, .6, 1}},
                                            {{-8, 5, -12}, {4, 10, 4}, .3, {.9, .9, .2}}};
    const FramePair frame = scene(2, 0);
    const cv::Vec3d ambient(.8, .9, 1);
    const std::string common = R"("density": 0, "sun_intensity": 0, "early_stop": false,
        "ambient": [0.8, 0.9, 1, 1], "boxes": [
        {"center": [0, 3, -20], "size": [20, 6, 20], "density": 0.08, "albedo": [1, 0.8, 0.6, 1]},
        {"center": [5, 2, -25], "size": [16, 8, 30], "density": 0.05, "albedo": [0.4, 0.6, 1, 1]},
        {"center": [-8, 5, -12], "size": [4, 10, 4], "density": 0.3, "albedo": [0.9, 0.9, 0.2, 1]}]})";
    const cv::Mat rendered = fromWallToWall(frame, boxes, ambient);
    expectSame(frame, R"({"effect": "volume_fog", "method": "midpoint", "steps": 128, )" + common, rendered,
               110);
    expectSame(frame, R"({"effect": "volume_fog", "method": "gauss_legendre", "steps": 128, )" + common,
               rendered, 90);
}

}  // namespace
}  // namespace brume
