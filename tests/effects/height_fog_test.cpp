// Theorems of layered fog; parity and reference are driven by the registry (tests/measure).
#include "fog_fixture.hpp"
#include "height_fog/derived.hpp"
#include "height_fog/methods.hpp"
#include "height_fog/reference.hpp"

namespace brume {
using namespace height_fog;
namespace {

const std::string fog = R"({"effect": "height_fog", "density": 0.02, "height": 1, "falloff": 0.3)";

TEST(HeightFog, NoDensityIsTheIdentityAlsoAtSky) {
    FramePair frame = fogFrame();
    frame.depth.at<float>(2, 3) = HUGE_VALF;
    frame.color.at<cv::Vec4f>(4, 5) = {HUGE_VALF, 65504, -1, 0};
    for (const char* profile : {"\"profile\": \"exponential\"", "\"profile\": \"ramp\", \"ramp\": []",
                                "\"profile\": \"table\", \"table\": []"}) {
        auto result =
            runFog(frame, std::string(R"({"effect": "height_fog", "density": 0, )") + profile + "}");
        EXPECT_EQ(cv::countNonZero(result.images["color"].reshape(1) != frame.color.reshape(1)), 0)
            << profile;
        EXPECT_EQ(cv::countNonZero(result.images["transmittance"].reshape(1) != 1), 0) << profile;
    }
}

TEST(HeightFog, WithoutFalloffIsHomogeneous) {
    FramePair frame = fogFrame();
    frame.depth.at<float>(2, 3) = HUGE_VALF;
    EXPECT_LT(
        apart(runFog(frame, R"({"effect": "height_fog", "density": 0.02, "falloff": 0})").images["color"],
              runFog(frame, R"({"effect": "depth_fog", "measure": "extinction", "extinction": 0.02})")
                  .images["color"]),
        2e-6);
    frame.depth.setTo(1e9);  // and so is the thinnest
    EXPECT_LT(apart(transmittanceOf(frame, R"({"effect": "height_fog", "density": 1e-9, "falloff": 0})"),
                    transmittanceOf(
                        frame, R"({"effect": "depth_fog", "measure": "extinction", "extinction": 1e-9})")),
              2e-6);
}

TEST(HeightFog, TransmittancesOfLayersMultiply) {
    FramePair frame = fogFrame();
    const cv::Mat one = transmittanceOf(frame, fog + "}");
    const cv::Mat two =
        transmittanceOf(frame, R"({"effect": "height_fog", "density": 0.05, "height": 4, "falloff": 1.5})");
    const cv::Mat both =
        transmittanceOf(frame, fog + R"(, "density2": 0.05, "height2": 4, "falloff2": 1.5})");
    EXPECT_LT(apart(one.mul(two), both), 1e-6);
    // fog after fog of one colour is the fog of both
    const std::string second = R"({"effect": "height_fog", "density": 0.05, "height": 4, "falloff": 1.5})";
    EXPECT_LT(
        apart(runFog(frame, fog + "}, " + second).images["color"],
              runFog(frame, fog + R"(, "density2": 0.05, "height2": 4, "falloff2": 1.5})").images["color"]),
        2e-6);
}

TEST(HeightFog, OpacityStaysInRangeAndGrowsWithDistance) {
    for (const char* profile : {"exponential", "ramp", "table"})
        for (double pitch : {-89., -10., 0., 10., 89.})
            for (double eye : {-3., 1., 30.}) {
                double last = 1;
                for (double depth = 1e-6; depth < 1e9; depth *= 1.9) {
                    FramePair frame = fogFrame({1, 1}, depth);
                    frame.camera.worldFromCamera = Camera::standing(eye, pitch);
                    const float T = transmittanceOf(frame, R"({"effect": "height_fog", "profile": ")" +
                                                               std::string(profile) + "\"}")
                                        .at<cv::Vec4f>(0, 0)[0];
                    ASSERT_GE(T, 0);
                    ASSERT_LE(T, last + 3e-7) << profile << " " << pitch << " " << eye << " " << depth;
                    last = T;
                }
            }
}

// Turning the camera about its eye leaves each world point's transmittance.
TEST(HeightFog, DoesNotSwimWhenTheCameraTurns) {
    FramePair frame = fogFrame({1, 1});
    const cv::Vec3d eye(0, 6, 0);
    for (const cv::Vec3d& point : {cv::Vec3d(3, 1, -20), cv::Vec3d(-8, 14, -40), cv::Vec3d(2, 6, -15)}) {
        double first = -1;
        for (double yaw : {-35., 0., 20.})
            for (double pitch : {-30., 0., 25.}) {
                frame.camera = Camera::withHorizontalView({1, 1}, 90);
                frame.camera.worldFromCamera = Camera::standing(eye[1]);
                turn(frame.camera, yaw, pitch);
                const cv::Matx44d cameraFromWorld = frame.camera.worldFromCamera.inv();
                const cv::Vec4d seen = cameraFromWorld * cv::Vec4d(point[0], point[1], point[2], 1);
                // the pixel is moved onto the point
                frame.camera.cx = .5 - seen[0] / -seen[2] * frame.camera.fx;
                frame.camera.cy = .5 + seen[1] / -seen[2] * frame.camera.fy;
                frame.depth.setTo(-seen[2]);
                const double T = transmittanceOf(frame, fog + "}").at<cv::Vec4f>(0, 0)[0];
                if (first < 0) first = T;
                EXPECT_NEAR(T, first, 1e-5);
            }
    }
}

// The probe set of MODELS.md §10, against quadrature.
TEST(HeightFog, ClosedFormHoldsAtTheProbes) {
    for (double k : {0., 1e-9, .05, 1., 88.})
        for (double dy : {0., 1e-8, -1e-8, 1e-3, -1e-3, 1., -1., 1e3, -1e3})
            for (double offset : {0., -5., 200.}) {
                HeightFog p;
                p.density = .05f, p.falloff = float(k), p.tint = {1, 1, 1};
                const double eye = offset, L = std::max(1., 1.5 * std::abs(dy));
                const double up = dy / L;
                const double truth = referenceDepth(p, eye, L, up, 0);
                const float logDensity = float(std::log(.05) - double(p.falloff) * eye);
                const double exponential = L * exponentialMean(logDensity, float(k), float(dy));
                const double layer = Layer::of(logDensity, float(k)).opticalDepth<false>(float(L), float(dy));
                const double relative = 4e-7 * (2 + std::abs(logDensity) + std::abs(k * dy));
                for (double ours : {exponential, layer}) {
                    EXPECT_NEAR(std::exp(-ours), std::exp(-truth), 2e-7 + relative * std::min(truth, .4))
                        << "k " << k << " dy " << dy << " eye " << eye;
                    EXPECT_FALSE(std::isnan(ours));
                }
            }
}

TEST(HeightFog, SkyIsTheLimitOfEverLongerWays) {
    for (const char* profile : {"exponential", "ramp", "table"})
        for (double pitch : {-40., 5., 60.}) {
            FramePair frame = fogFrame({3, 3}, 1e9);
            frame.camera.worldFromCamera = Camera::standing(1.6, pitch);
            const std::string step =
                R"({"effect": "height_fog", "profile": ")" + std::string(profile) + "\"}";
            const cv::Mat far = transmittanceOf(frame, step);
            frame.depth.setTo(HUGE_VALF);
            EXPECT_LT(apart(far, transmittanceOf(frame, step)), 2e-6) << profile << " " << pitch;
        }
}

TEST(HeightFog, TheThinnestFogHidesSkyUnlessItEnds) {
    FramePair frame = fogFrame({3, 3}, HUGE_VAL);
    frame.depth.at<float>(0, 0) = 1e9f;
    frame.camera.worldFromCamera = Camera::standing(1.6, 50);
    for (const char* density : {"1e-20", "1e-29", "1e-35"}) {
        const cv::Mat T = transmittanceOf(
            frame, R"({"effect": "height_fog", "falloff": 0, "density": )" + std::string(density) + "}");
        EXPECT_EQ(T.at<cv::Vec4f>(0, 0)[0], 1) << density;
        EXPECT_EQ(T.at<cv::Vec4f>(1, 1)[0], 0) << density;
        EXPECT_EQ(transmittanceOf(frame, R"({"effect": "height_fog", "falloff": 1e-9, "density": )" +
                                             std::string(density) + "}")
                      .at<cv::Vec4f>(1, 1)[0],
                  1)
            << density;
    }
}

// Of a layer below the Earth nothing is seen on ways that end above it, and nothing else on those that do
// not.
TEST(HeightFog, ALayerIsMetHoweverDeep) {
    FramePair frame = fogFrame({3, 3}, HUGE_VAL);
    frame.depth.row(0) = 1e9f, frame.depth.row(2) = 1e7f;
    frame.camera.worldFromCamera = Camera::standing(1.6, -80);
    for (const char* falloff : {"0.02", "0.1", "1", "100"}) {
        const cv::Mat T = transmittanceOf(
            frame, R"({"effect": "height_fog", "height": -2e7, "falloff": )" + std::string(falloff) + "}");
        for (int j = 0; j < 3; j++)
            EXPECT_EQ(T.at<cv::Vec4f>(j, 1)[0], j == 2 ? 1 : 0) << falloff << " in row " << j;
    }
}

// A world moved up by 1e6 or 1e7 m, and its fog with it, is the same picture.
TEST(HeightFog, FarOriginsLoseNothing) {
    for (const char* profile : {"exponential", "ramp", "table"})
        for (int up : {1000000, 10000000}) {
            auto at = [&](int offset) {
                FramePair frame = fogFrame();
                frame.camera.worldFromCamera = Camera::standing(2. + offset, -5);
                auto height = [&](int h) { return std::to_string(h + offset); };
                return transmittanceOf(
                    frame, R"({"effect": "height_fog", "profile": ")" + std::string(profile) +
                               R"(", "height": )" + height(1) + R"(, "table_bottom": )" + height(0) +
                               R"(, "table_top": )" + height(20) + R"(, "ramp": [{"height": )" + height(0) +
                               R"(, "density": 0.1}, {"height": )" + height(8) + R"(, "density": 0}]})");
            };
            EXPECT_LT(apart(at(0), at(up - up % 16)), 1e-6) << profile << " " << up;
        }
}

TEST(HeightFog, TintMakesEachChannelItsOwnFog) {
    FramePair frame = fogFrame();
    const cv::Mat tinted = transmittanceOf(frame, fog + R"(, "tint": [1, 0.5, 0.1]})");
    const double parts[3] = {1, .5, .1};
    for (int n = 0; n < 3; n++) {
        const std::string density = std::to_string(.02 * parts[n]);
        const cv::Mat grey = transmittanceOf(
            frame, R"({"effect": "height_fog", "height": 1, "falloff": 0.3, "density": )" + density + "}");
        cv::Mat a, b;
        cv::extractChannel(tinted, a, n), cv::extractChannel(grey, b, n);
        EXPECT_LT(apart(a, b), 1e-6) << n;
    }
}

// --- methods converge in fp64 on a smooth profile

HeightFog smoothFog(Method method) {
    HeightFog p;
    p.density = .05f, p.falloff = .2f, p.height = 0, p.tint = p.tint2 = {1, 1, 1};
    p.method = method, p.tableBottom = 0, p.tableTop = 32;
    return p;
}

TEST(HeightFogMethods, MarchConvergesAtOrderTwo) {
    const HeightFog p = smoothFog(march);
    const double truth = referenceDepth(p, 1.7, 30, .6, 0);
    std::vector<double> sizes, errors;
    for (int steps : {8, 16, 32, 64, 128}) {
        const double mean =
            marchMean(18., steps, [&](double y) { return .05f * std::exp(-double(.2f) * (1.7 + y)); });
        sizes.push_back(1. / steps), errors.push_back(std::abs(30 * mean - truth));
    }
    EXPECT_NEAR(fittedOrder(sizes, errors), 2, .1);
}

template <Method method>
double tableOrder() {
    HeightFog p = smoothFog(method);
    std::vector<double> sizes, errors;
    for (int nodes : {17, 33, 65, 129}) {
        p.tableSize = nodes;
        // the worst over places in a cell
        double worst = 0;
        for (double eye = 3; eye < 7; eye += .37) {
            const Table t = makeTable(p, eye);
            std::vector<double> density, mean, toNode;
            for (size_t k = 0; k < t.density.size(); k++)
                for (int n = 0; n < 4; n++) {
                    density.push_back(n < 3 ? t.density[k][n] : 0);
                    mean.push_back(n < 3 ? t.mean[k][n] : 0);
                    toNode.push_back(n < 3 ? t.toNode[k][n] : 0);
                }
            const TableView<double> view{density.data(), mean.data(),  toNode.data(), nodes,
                                         t.base,         t.baseHeight, t.step};
            for (double dy : {9.3, 13.9, -2.2}) {
                const double truth = referenceDepth(p, eye, std::abs(dy) * 2, dy / (std::abs(dy) * 2), 0);
                worst = std::max(worst, std::abs(view.mean<method>(0, dy) * std::abs(dy) * 2 - truth));
            }
        }
        sizes.push_back(1. / (nodes - 1)), errors.push_back(worst);
    }
    return fittedOrder(sizes, errors);
}
TEST(HeightFogMethods, LinearTableConvergesAtOrderTwo) { EXPECT_NEAR(tableOrder<tableLinear>(), 2, .2); }
TEST(HeightFogMethods, HermiteTableConvergesAtOrderFour) { EXPECT_NEAR(tableOrder<tableHermite>(), 4, .3); }

// A table of even density is that density, however fine, wherever the eye: nodes' heights are rounded in
// fp32.
TEST(HeightFogMethods, TableOfEvenDensityIsEven) {
    for (const char* method : {"table linear", "table Hermite"})
        for (double eye : {1.6, 250.3}) {
            FramePair frame = fogFrame({48, 27}, .7);
            frame.camera.worldFromCamera(1, 3) = eye;
            const std::string rest = R"("profile": "ramp", "ramp": [{"height": 3, "density": 0.2}],
                                        "table_bottom": -28.86, "table_top": 23.7, "table_size": 3706})";
            const cv::Mat table = transmittanceOf(frame, R"({"effect": "height_fog", "method": ")" +
                                                             std::string(method) + "\", " + rest),
                          closed = transmittanceOf(
                              frame, R"({"effect": "height_fog", "method": "closed form", )" + rest);
            EXPECT_LT(apart(table, closed), 4e-7) << method << " " << eye;
        }
}

// Published: the staircase of a linear table, 8 % of density at k = .1 and steps of 1.56 m, and Hermite's
// 3e-5.
TEST(HeightFogMethods, OnShortWaysTheLinearTableIsAStaircaseAndHermiteIsNot) {
    HeightFog p;
    p.density = .05f, p.falloff = .1f, p.tint = {1, 1, 1}, p.tableBottom = 0, p.tableTop = 400,
    p.tableSize = 257;
    auto worst = [&](Method method, auto rule) {
        p.method = method;
        double largest = 0;
        for (double eye = 10; eye < 14; eye += .05) {
            const Table t = makeTable(p, eye);
            std::vector<double> flat[3];
            for (size_t k = 0; k < t.density.size(); k++)
                for (int n = 0; n < 4; n++) {
                    flat[0].push_back(n < 3 ? t.density[k][n] : 0);
                    flat[1].push_back(n < 3 ? t.mean[k][n] : 0);
                    flat[2].push_back(n < 3 ? t.toNode[k][n] : 0);
                }
            const TableView<double> view{flat[0].data(), flat[1].data(), flat[2].data(), 257,
                                         t.base,         t.baseHeight,   t.step};
            const double truth = referenceDepth(p, eye, 1, 1e-3, 0);
            largest = std::max(largest, std::abs(rule(view, 1e-3) / truth - 1));
        }
        return largest;
    };
    const double linear =
        worst(tableLinear, [](auto& v, double dy) { return v.template mean<tableLinear>(0, dy); });
    const double hermite =
        worst(tableHermite, [](auto& v, double dy) { return v.template mean<tableHermite>(0, dy); });
    EXPECT_NEAR(linear, .08, .01);
    EXPECT_LT(hermite, 4e-5);
    EXPECT_GT(hermite, 1e-6);
}

}  // namespace
}  // namespace brume
