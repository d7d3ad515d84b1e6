// P1's offset, a scalar added to the view vector, where both are next to nothing or cancel.
#include "apply/apply.hpp"
#include "fog_fixture.hpp"
#include "gl/gl_runner.hpp"

namespace brume {
namespace {

TEST(FogSun, TinyOffsetsAndVectorsThatCancelGiveNoNan) {
    FramePair frame = fogFrame({4, 3});
    const float depths[] = {0, 1e-30f, 1e-20f, 1, 1e20f, HUGE_VALF};
    for (int k = 0; k < 12; k++) frame.depth.at<float>(k / 4, k % 4) = depths[k % 6];
    // one pixel looks along -(1, 1, 1) from 1 m, where an offset of √⅓ cancels the view vector
    frame.camera = Camera::withHorizontalView({4, 3}, 90);
    turn(frame.camera, 45, -35.26438968);
    frame.camera.cx = 1.5, frame.camera.cy = 1.5;
    frame.depth.at<float>(1, 1) = 1;
    const auto gl = makeGlRunner(GlPlatform::Auto), cpu = makeCpuRunner();
    for (const char* offset : {"1e-38", "1e-30", "1e-25", "1e-19", "0.57735026", "0.57735032"})
        for (const std::string fog :
             {R"({"effect": "depth_fog", "extinction": 0.02, "measure": "extinction",
                                          "sun": "power", "sun_offset": )",
              R"({"effect": "noise_fog", "sun_color": [1, 0.6, 0.2], "sun_offset": )"}) {
            const Chain chain = planChain(
                parsePreset("{\"effects\": [" + fog + offset + "}]}", "test", EffectRegistry::standard()),
                frame, Backend::Cpu, {});
            const cv::Mat a = cpu->run(chain, frame, {}).images.at("color"),
                          b = gl->run(chain, frame, {}).images.at("color");
            for (int k = 0; k < 12; k++)
                for (int n = 0; n < 3; n++) {
                    ASSERT_TRUE(std::isfinite(a.at<cv::Vec4f>(k / 4, k % 4)[n]))
                        << "CPU " << fog << offset << " " << k;
                    ASSERT_TRUE(std::isfinite(b.at<cv::Vec4f>(k / 4, k % 4)[n]))
                        << "GLSL " << fog << offset << " " << k;
                }
        }
}

}  // namespace
}  // namespace brume
