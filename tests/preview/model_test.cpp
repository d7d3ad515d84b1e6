// Where the picture lies, what a pixel holds, where two results differ, which files changed.
#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "frame/write.hpp"
#include "host/program.hpp"
#include "preview/display.hpp"
#include "preview/frame_loader.hpp"
#include "preview/picture_view.hpp"
#include "preview/probe.hpp"
#include "preview/renderer.hpp"
#include "preview/watcher.hpp"

namespace brume::preview {
namespace {

TEST(PictureView, FitsAndZoomsAboutAPoint) {
    PictureView view;
    view.place({10, 20, 800, 400}, {400, 400});
    EXPECT_EQ(view.zoom(), 1);
    EXPECT_EQ(view.toWindow({0, 0}), cv::Point2d(210, 20));
    const cv::Point2d at(300, 100), under = view.toPicture(at);
    for (double factor : {1.7, 3., .5, .25}) {
        view.zoomBy(factor, at);
        // At 1:1 and above the corner is put on a whole pixel: at most half a window px off.
        EXPECT_LE(cv::norm(view.toWindow(under) - at), .75) << factor;
    }
    EXPECT_FALSE(view.isFit());
    view.zoomTo(1.01, at);
    EXPECT_EQ(view.zoom(), 1);  // round zooms attract
    const cv::Point2d corner = view.toWindow({0, 0});
    EXPECT_EQ(corner, cv::Point2d(std::round(corner.x), std::round(corner.y)));
    view.pan({1e6, -1e6});  // the picture cannot be lost
    EXPECT_EQ(view.toPicture(view.middle()).x, 0);
    view.fit();
    EXPECT_EQ(view.toWindow({0, 0}), cv::Point2d(210, 20));
}

TEST(Probe, KnowsDepthDistanceAndPlace) {
    LoadedFrame loaded;
    loaded.frame = test::sampleFrame({40, 30});
    const cv::Point sky(3, 2), ground(31, 28);
    Rendered rendered;
    rendered.job.frame = std::shared_ptr<const FramePair>(&loaded.frame, [](const FramePair*) {});
    rendered.images["color"] = cv::Mat(cv::Size(20, 15), CV_32FC4, cv::Scalar(1, 2, 3, 1));  // half size
    const Probe probe = probeAt(loaded, &rendered, ground);
    ASSERT_TRUE(probe.position && probe.after);
    EXPECT_FALSE(probe.transmittance);
    EXPECT_EQ((*probe.after)[1], 2);
    // The ground of the sample lies 1.6 m below the eye, which stands at 1.6: 4 ulp of depth in fp32.
    EXPECT_NEAR((*probe.position)[1], 0, 1e-6);
    EXPECT_NEAR(cv::norm(*probe.position - loaded.frame.camera.eye()), probe.distance,
                1e-12 * probe.distance);
    EXPECT_LT(double(probe.depth), probe.distance);
    const Probe above = probeAt(loaded, nullptr, sky);
    EXPECT_FALSE(above.position || above.after);
    EXPECT_TRUE(std::isinf(above.distance));
    EXPECT_GT(above.direction[1], 0);
    EXPECT_NEAR(cv::norm(above.direction), 1, 1e-12);
    for (const auto& [label, value] : probeLines(above)) EXPECT_NE(value, "") << label;
}

TEST(Difference, FindsTheLargestAndCountsWhatIsNoNumber) {
    cv::Mat a(8, 9, CV_32FC4, cv::Scalar(.5, .5, .5, 1)), b = a.clone();
    b.at<cv::Vec4f>(3, 4) = {.5f, .75f, .5f, 0};
    b.at<cv::Vec4f>(5, 6) = {NAN, .5f, .5f, 1};
    a.at<cv::Vec4f>(1, 1) = b.at<cv::Vec4f>(1, 1) = {INFINITY, .5f, .5f, 1};
    const Difference d = differenceOf(a, b);
    EXPECT_EQ(d.largest, .25);
    EXPECT_EQ(d.where, cv::Point(4, 3));
    EXPECT_EQ(d.mean, .25 / 72);
    EXPECT_EQ(d.unlike, 1u);
    EXPECT_EQ(d.heat.at<cv::Vec3b>(0, 0), heatColor(0));
    EXPECT_EQ(d.heat.at<cv::Vec3b>(1, 1), heatColor(0));
    EXPECT_EQ(d.heat.at<cv::Vec3b>(3, 4), heatColor(1));
}

TEST(Smaller, KeepsTheView) {
    ReadyFrame ready;
    ready.frame = test::sampleFrame({64, 48});
    const ReadyFrame half = smaller(ready, 2);
    EXPECT_EQ(half.frame.size(), cv::Size(32, 24));
    EXPECT_EQ(half.frame.statedSize(), cv::Size(64, 48));
    // A pixel of the half looks where the corner of four pixels of the whole does.
    const View whole = viewFor(ready.frame, ready.frame.size()),
               small = viewFor(half.frame, half.frame.size());
    const cv::Vec3d p = Camera(ready.frame.camera).ray(20.5, 30.5);
    const cv::Vec3d q = half.frame.camera.resized(half.frame.statedSize(), half.frame.size()).ray(10, 15);
    EXPECT_LT(cv::norm(p - q), 1e-12);
    EXPECT_EQ(whole.time, small.time);
}

class Roles : public test::Program {};
TEST_F(Roles, EachFileOfAFrameHasAName) {
    addFrame("both.exr", {8, 6});
    FramePair frame = test::sampleFrame({8, 6});
    writeImage(path("a.png"), frame.color);
    writeImage(path("a.depth.exr"), frame.depth, {.isData = true});
    writeImage(path("sun.exr"), frame.depth, {.isData = true});
    addText("a.json", R"({"lights": [{"shadow_map": "sun.exr"}]})");
    const auto roles = [&](const char* name) {
        std::vector<std::string> all;
        const auto loaded = loadFrame({path(name), "", {}, ""}, 0, {}, 24);
        for (const std::string& file : loaded->frame.files) all.push_back(roleOf(file, loaded->capture));
        return all;
    };
    EXPECT_THAT(roles("both.exr"), testing::ElementsAre("file"));
    EXPECT_THAT(roles("a.png"), testing::ElementsAre("picture", "depth file", "sidecar", "light map"));
}

TEST(Watcher, SeesWritingReplacingAndVanishing) {
    const std::string folder = testing::TempDir() + "brume-watcher-" + std::to_string(getpid());
    std::filesystem::create_directories(folder);
    const std::string a = folder + "/a", b = folder + "/b";
    std::ofstream(a) << "1";
    Watcher watcher;
    watcher.watch({a, b});
    EXPECT_TRUE(watcher.changed().empty());
    std::ofstream(a) << "12";
    EXPECT_THAT(watcher.changed(), testing::ElementsAre(a));
    EXPECT_TRUE(watcher.changed().empty());
    std::ofstream(b) << "1";
    EXPECT_THAT(watcher.changed(), testing::ElementsAre(b));
    std::ofstream(folder + "/new") << "12";
    std::filesystem::rename(folder + "/new", a);  // as many editors save
    EXPECT_THAT(watcher.changed(), testing::ElementsAre(a));
    std::filesystem::remove(b);
    EXPECT_THAT(watcher.changed(), testing::ElementsAre(b));
    std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace brume::preview
