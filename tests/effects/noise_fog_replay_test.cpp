// What the noise is looked up by in fp32 (a volume's texels, steps along the ray) against the same in fp64,
// over the check's frames and parameters. The check grants methods the whole distance to the truth, on either
// side of it.
#include "error.hpp"
#include "fog_fixture.hpp"
#include "measure/check.hpp"
#include "noise_fog/reference.hpp"

namespace brume {
using namespace noise_fog;
namespace {

struct Replay {
    double worst = 0;  // of what the check allows without a method's error
    std::string where;
    size_t compared = 0, leftOut = 0;
};

void replay(const std::string& name, const ParameterValues& values, Replay& replay) {
    const auto effect = EffectRegistry::standard().find("noise_fog");
    const auto params = effect->plugin->makeParams(values);
    const NoiseFog& p = *static_cast<const NoiseFog*>(params.get());
    if (p.where == asAProduct || (p.where == atTheSurface && !p.isBaked())) return;  // exact
    static const std::vector<CheckFrame> frames = checkFrames();
    static const auto cpu = makeCpuRunner();
    Chain chain;
    Step step;
    step.id = "fog", step.effect = effect, step.values = values, step.input = step.output = "color";
    chain.steps = {step};
    for (const CheckFrame& source : frames) {
        const FramePair& frame = source.frame;
        const cv::Mat T = cpu->run(chain, frame, {"transmittance"}).images.at("transmittance");
        const cv::Vec3d eye = frame.camera.eye();
        const ReferenceContext context{frame.camera, frame.size(), frame.color, frame.depth, {},
                                       frame.time,   frame.index,  frame.seed,  frame.extras};
        const ReferenceNoise noise{p, eye, frame.time};
        const ReferenceProduct product(p, eye, frame.time);
        for (int k = 0; k < int(T.total()); k += 1 + int(T.total()) / 48) {
            const cv::Point at(k % T.cols, k / T.cols);
            const ReferencePixel pixel = referencePixel(p, product, context, at);
            if (pixel.ambiguous) {
                replay.leftOut++;
                continue;
            }
            const cv::Vec3d ray = frame.camera.ray(at.x, at.y);
            const double L = double(frame.depth.at<float>(at)) * cv::norm(ray);
            const cv::Vec3d d =
                frame.camera.worldFromCamera.get_minor<3, 3>(0, 0) * ray * (1 / cv::norm(ray));
            double n = .5;
            if (p.where == atTheSurface) {
                if (L / p.size <= 4096) n = noise.interpolated(noise.cells(d * L));
            } else {
                const double reach = std::min(L, double(p.range)), share = L > p.range ? p.range / L : 1;
                n = .5 + share * (noise.middleMean(d, reach) - .5);
            }
            const double wanted =
                outcomeOf(p, {}, L, relativeDensity(p, n, std::min(L, 1e15) * d[1]), n, 0).transmittance;
            const double apart = std::abs(T.at<cv::Vec4f>(at)[0] - wanted),
                         bound = effect->header.tolerance.reference + pixel.transmittanceAllowance;
            replay.compared++;
            if (!(apart / bound <= replay.worst))
                replay.worst = apart / bound,
                replay.where = text(source.name, ", ", name, " at ", at.x, ", ", at.y, ": ",
                                    T.at<cv::Vec4f>(at)[0], " for ", wanted);
        }
    }
}

TEST(NoiseFogMethods, InFp32AreThemselvesInFp64OnTheChecksFrames) {
    CheckOptions options;
    options.randomSets = 8, options.seed = 9;
    Replay seen;
    for (const auto& [name, values] :
         checkParameters(EffectRegistry::standard().find("noise_fog")->header, options))
        replay(name, values, seen);
    EXPECT_LE(seen.worst, .1) << seen.where;  // measured: .024
    EXPECT_GT(seen.compared, 2000u);
    EXPECT_LE(seen.leftOut, seen.compared / 100);
}

// Few texels and holes with hard edges: where the truth has none of the fog, or all of it, the method is on
// the slope between, and its roundings show.
TEST(NoiseFogMethods, InFp32AreThemselvesInFp64WhereTheTruthIsAtALimit) {
    CheckOptions options;
    options.randomSets = 1, options.seed = 12;
    Replay seen;
    for (const auto& [name, values] :
         checkParameters(EffectRegistry::standard().find("noise_fog")->header, options))
        if (name == "random 1") replay(name, values, seen);
    EXPECT_LE(seen.worst, .1) << seen.where;  // measured: .036; 6.4 where roundings are taken at the truth
    EXPECT_GT(seen.compared, 300u);
}

}  // namespace
}  // namespace brume
