// The methods that only approximate layered fog, in fp32, against themselves in fp64. The check grants them
// their own error, which says nothing where that is large (a table that ends below a layer, a march over it).
#include "error.hpp"
#include "fog_fixture.hpp"
#include "gl/gl_runner.hpp"
#include "height_fog/reference.hpp"
#include "measure/check.hpp"

namespace brume {
using namespace height_fog;
namespace {

struct Worst {
    double apart = 0;
    std::string where;
};

// The largest difference of transmittances, beyond what 4 ulp of way, direction and heights do.
template <class Depth>
void compare(const std::string& name, const Step& step, const Depth& replayed, const FramePair& frame,
             Worst& worst) {
    Chain chain;
    chain.steps = {step};
    const cv::Mat T = makeCpuRunner()->run(chain, frame, {"transmittance"}).images.at("transmittance");
    const double eye = frame.camera.eye()[1], ulps = 4 * std::numeric_limits<float>::epsilon();
    const auto& m = frame.camera.worldFromCamera;
    for (int k = 0; k < int(T.total()); k += k % 19 + 5) {
        const int i = k % T.cols, j = k / T.cols;
        const cv::Vec3d ray = frame.camera.ray(i, j);
        const double L = double(frame.depth.at<float>(j, i)) * cv::norm(ray);
        if (L > 1e30) continue;  // endless, which no table or march ends: the closed form
        const double up = (m(1, 0) * ray[0] + m(1, 1) * ray[1] + m(1, 2) * ray[2]) / cv::norm(ray);
        for (int n = 0; n < 3; n++) {
            const double truth = std::exp(-replayed(eye, L, up, n));
            auto change = [&](double eyeMoved, double way, double turned) {
                return std::abs(std::exp(-replayed(eyeMoved, way, turned, n)) - truth);
            };
            double allowed = 0;
            for (double shift : {-ulps, ulps})
                allowed += change(eye, L * (1 + shift), up) + change(eye, L, up + shift) +
                           change(eye + shift * std::abs(L * up), L, up);
            const double apart = std::abs(double(T.at<cv::Vec4f>(j, i)[n]) - truth) - allowed;
            if (apart > worst.apart) worst = {apart, text(name, " at ", i, ", ", j)};
        }
    }
}

TEST(HeightFogMethods, InFp32AreThemselvesInFp64) {
    const auto effect = EffectRegistry::standard().find("height_fog");
    CheckOptions options;
    options.randomSets = 20, options.seed = 9;
    const std::vector<CheckFrame> frames = checkFrames();
    Worst worst;
    int sets = 0;
    for (const auto& [name, values] : checkParameters(effect->header, options)) {
        Step step;
        step.id = "fog", step.effect = effect, step.values = values, step.input = step.output = "color";
        const auto params = effect->plugin->makeParams(values);
        const ApproximateDepth replayed(*static_cast<const HeightFog*>(params.get()));
        if (replayed.isExact()) continue;
        sets++;
        for (const CheckFrame& frame : frames)
            compare(frame.name + ", " + name, step, replayed, frame.frame, worst);
    }
    EXPECT_GT(sets, 8);
    // measured: 1.04e-6
    EXPECT_LT(worst.apart, 2e-6) << worst.where;
}

// A table as high as the Earth, whose first node fp32 places to a metre only; without fog at the ground,
// beside which the density is what a cell's great one leaves.
std::string hugeTable(const char* method) {
    std::string table;
    for (int k = 0; k < 20; k++) table += text(k ? ", " : "", "{\"density\": ", k == 10 ? 0 : 50, "}");
    return text(R"({"effects": [{"effect": "height_fog", "profile": "table", "method": ")", method,
                R"(", "table_bottom": -1e7, "table_top": 9e6, "table_size": 20, "table": [)", table, "]}]}");
}
const char* const methodNames[] = {"closed form", "table linear", "table Hermite", "march"};

TEST(HeightFogMethods, HalvesAgreeInAHugeTable) {
    FramePair frame = fogFrame();
    const auto cpu = makeCpuRunner(), gl = makeGlRunner(GlPlatform::Osmesa);
    for (double height : {1.6, -730., 4321.}) {
        frame.camera.worldFromCamera = Camera::standing(height, -5);
        for (const char* method : methodNames) {
            const Chain chain = parsePreset(hugeTable(method), "test", EffectRegistry::standard());
            const cv::Mat a = cpu->run(chain, frame, {"transmittance"}).images.at("transmittance"),
                          b = gl->run(chain, frame, {"transmittance"}).images.at("transmittance");
            EXPECT_LT(cv::norm(a, b, cv::NORM_INF), 2e-6) << method << " from " << height << " m";
        }
    }
}

TEST(HeightFogMethods, HugeTablesHoldNearTheEye) {
    FramePair frame = fogFrame();
    frame.camera.worldFromCamera = Camera::standing(1.6, -5);
    for (const char* method : methodNames) {
        const Step step = parsePreset(hugeTable(method), "test", EffectRegistry::standard()).steps.front();
        const auto params = step.effect->plugin->makeParams(step.values);
        const auto& p = *static_cast<const HeightFog*>(params.get());
        const ApproximateDepth approximate(p);
        Worst worst;
        auto depthOf = [&](double eye, double L, double up, int n) {
            return approximate.isExact() ? referenceDepth(p, eye, L, up, n) : approximate(eye, L, up, n);
        };
        compare(method, step, depthOf, frame, worst);
        EXPECT_LT(worst.apart, 2e-6) << worst.where;  // measured: 5e-9
    }
}

}  // namespace
}  // namespace brume
