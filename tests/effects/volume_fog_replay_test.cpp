// Every method in fp32 against itself in fp64, over the check's frames and parameters. The check grants
// methods the whole distance to the truth, on either side of it, which says nothing where that is large (p2,
// a step through a dense box).
#include "error.hpp"
#include "fog_fixture.hpp"
#include "measure/check.hpp"
#include "volume_fog/reference.hpp"

namespace brume {
namespace {

TEST(VolumeFogMethods, InFp32AreThemselvesInFp64OnTheChecksFrames) {
    using namespace volume_fog;
    const auto effect = EffectRegistry::standard().find("volume_fog");
    const Tolerance& tolerance = effect->header.tolerance;
    CheckOptions options;
    options.randomSets = 8, options.seed = 9;
    const std::vector<CheckFrame> frames = checkFrames();
    const auto cpu = makeCpuRunner();
    double worst = 0;
    std::string where;
    size_t compared = 0, leftOut = 0;
    for (const auto& [name, values] : checkParameters(effect->header, options))
        for (const CheckFrame& source : frames) {
            const FramePair& frame = source.frame;
            Chain chain;
            Step step;
            step.id = "fog", step.effect = effect, step.values = values, step.input = step.output = "color";
            chain.steps = {step};
            const cv::Mat image = cpu->run(chain, frame, {}).images.at("color");
            const auto params = effect->plugin->makeParams(values);
            const ReferenceContext context{frame.camera, frame.size(), frame.color, frame.depth, {},
                                           frame.time,   frame.index,  frame.seed,  frame.extras};
            const truth::Scene scene(*static_cast<const Params*>(params.get()), context);
            for (int k = 0; k < int(image.total()); k += 1 + int(image.total()) / 24) {
                const cv::Point at(k % image.cols, k / image.cols);
                const ReferencePixel pixel = referencePixel(scene, context, at);
                if (pixel.ambiguous) {
                    leftOut++;
                    continue;
                }
                const cv::Vec3d ray = frame.camera.ray(at.x, at.y);
                const cv::Vec3d d =
                    frame.camera.worldFromCamera.get_minor<3, 3>(0, 0) * ray * (1 / cv::norm(ray));
                const truth::Ray r{
                    scene, d,
                    std::min(frame.depth.at<float>(at) * cv::norm(ray), double(scene.p.max_distance))};
                const cv::Vec4f color = frame.color.at<cv::Vec4f>(at);
                const auto replayed = truth::Replay(r, color, at, frame.index, frame.seed).run();
                compared++;
                for (int n = 0; n < 3; n++) {
                    const double wanted =
                        (replayed.transmittance > std::exp(-87.) ? color[n] * replayed.transmittance : 0) +
                        replayed.scattered[n];
                    const double apart = std::abs(image.at<cv::Vec4f>(at)[n] - wanted);
                    if (!std::isfinite(wanted)) continue;
                    const double scale = std::isfinite(pixel.scale) ? pixel.scale
                                                                    : std::max(1., std::abs(wanted)),
                                 bound = tolerance.reference * scale + pixel.allowance;
                    if (!(apart / bound <= worst))
                        worst = apart / bound,
                        where = text(source.name, ", ", name, " at ", at.x, ", ", at.y, ": ",
                                     image.at<cv::Vec4f>(at)[n], " for ", wanted);
                }
            }
        }
    EXPECT_LE(worst, 1) << where;  // measured: .64
    EXPECT_GT(compared, 8000u);
    EXPECT_LE(leftOut, compared / 100);
}

// The largest share that the CPU half takes of what the reference grants, beside 2e-6 of a pixel's scale:
// less than the check's own.
double shareOfBound(const Chain& chain, const FramePair& frame) {
    using namespace volume_fog;
    const Effect& effect = *chain.steps.front().effect;
    const cv::Mat image = makeCpuRunner()->run(chain, frame, {}).images.at("color");
    const auto params = effect.plugin->makeParams(chain.steps.front().values);
    const ReferenceContext context{frame.camera, frame.size(), frame.color, frame.depth, {},
                                   frame.time,   frame.index,  frame.seed,  frame.extras};
    const truth::Scene scene(*static_cast<const Params*>(params.get()), context);
    double worst = 0;
    for (int i = 0; i < int(image.total()); i++) {
        const cv::Point at(i % image.cols, i / image.cols);
        const ReferencePixel pixel = referencePixel(scene, context, at);
        const double bound = 2e-6 * pixel.scale + pixel.allowance + pixel.methodError;
        for (int n = 0; n < 3; n++)
            worst = std::max(worst, std::abs(image.at<cv::Vec4f>(at)[n] - pixel.color[n]) / bound);
    }
    return worst;
}

// Hundreds of equal steps are all rounded alike: up to 1.1e-5 of the light at 486, which the reference's own
// account of its sums grants.
TEST(VolumeFogMethods, ManyThinStepsRoundNoMoreThanTheirSumsMay) {
    FramePair frame = fogFrame({20, 4});
    int k = 0;
    for (float& depth : cv::Mat_<float>(frame.depth)) depth = 2e-5f * float(++k);
    for (const char* method : {"left", "midpoint", "jittered", "gauss_legendre"}) {
        const Chain chain = parsePreset(
            text(R"({"effects": [{"effect": "volume_fog", "steps": 486, "method": ")", method,
                 R"(", "density": 0.02, "ambient": [60000, 9000, 50000], "height_falloff": "none"}]})"),
            "test", EffectRegistry::standard());
        EXPECT_LE(shareOfBound(chain, frame), 1) << method;
    }
}

// Rays that dip a decimetre into fog whose linear falloff ends there: where they enter it is rounded by
// micrometres, which is much of its little depth, and all the light there is counts.
TEST(VolumeFogMethods, ALittleDepthInBrightLightMayBeRoundedAsItsLightIs) {
    FramePair frame = fogFrame({20, 4});
    cv::Mat(frame.depth).setTo(171.2156781725841);
    frame.camera = Camera::withHorizontalView(frame.size(), 2);
    turn(frame.camera, 0, -90);
    frame.camera.worldFromCamera(1, 3) = 250;
    for (const char* method : {"left", "midpoint", "jittered", "gauss_legendre"})
        for (double top : {79., 78.9, 78.82}) {
            const Chain chain = parsePreset(
                text(
                    R"({"effects": [{"effect": "volume_fog", "method": ")", method,
                    R"(", "steps": 464, "early_stop": false, "max_distance": 171.2156781725841, "density": 0.019,)",
                    R"("ambient": [60000, 9000, 50000], "height_falloff": "linear", "height_start": )",
                    top - 139, R"(, "height_distance": 139}]})"),
                "test", EffectRegistry::standard());
            EXPECT_LE(shareOfBound(chain, frame), 1) << method << " " << top;  // measured: .15 to .71
        }
}

}  // namespace
}  // namespace brume
