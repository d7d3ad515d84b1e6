// Frames recorded from programs that we did not write: the positions that brume finds in them must fit the
// programs' known geometry.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "frame/read.hpp"
#include "run.hpp"

namespace {

using brume::FramePair;

std::string captured(const std::string& options, const std::string& program) {
    return "timeout 60 xvfb-run -a -s '-screen 0 1024x768x24' " + binFolder + "/brume_capture " + options +
           " " + program;
}

cv::Vec3d position(const FramePair& frame, int i, int j) {
    return frame.camera.ray(i, j) * double(frame.depth.at<float>(j, i));
}

std::vector<cv::Vec3d> surfaces(const FramePair& frame) {
    std::vector<cv::Vec3d> points;
    for (int j = 0; j < frame.depth.rows; j++)
        for (int i = 0; i < frame.depth.cols; i++)
            if (std::isfinite(frame.depth.at<float>(j, i))) points.push_back(position(frame, i, j));
    return points;
}

}  // namespace

// glxgears: three gears with the z axis as theirs, 1, 2 and .5 thick, the first of radius 4 and tooth .7
// about
// (-3, -2); seen from 40 away, turned by 20° about x and 30° about y. glFrustum(-1, 1, -h, h, 5, 60).
TEST(Capture, GlxgearsLieInTheirPlanes) {
    if (!hasProgram("glxgears") || !hasProgram("xvfb-run")) GTEST_SKIP() << "no glxgears or xvfb-run here";
    const ScratchFolder folder;
    const RunOutput run = runCommand(
        captured("--every 5 --count 1 --then-quit -o " + folder.path(), "glxgears -geometry 400x300"));
    const std::string file = folder / "frame_00005.png";
    ASSERT_TRUE(std::filesystem::exists(file)) << run.text;
    const FramePair frame = brume::readFrame(file);
    ASSERT_EQ(frame.size(), cv::Size(400, 300));
    EXPECT_NEAR(frame.camera.fx, 5 * 400 / 2., 1e-3);
    EXPECT_NEAR((*frame.extras)["depth"]["near"].get<double>(), 5, 1e-4);
    EXPECT_NEAR((*frame.extras)["depth"]["far"].get<double>(), 60, 1e-3);

    const double x = 20 * CV_PI / 180, y = 30 * CV_PI / 180;
    const cv::Matx33d aboutX(1, 0, 0, 0, std::cos(x), -std::sin(x), 0, std::sin(x), std::cos(x));
    const cv::Matx33d aboutY(std::cos(y), 0, std::sin(y), 0, 1, 0, -std::sin(y), 0, std::cos(y));
    const cv::Matx33d gearFromEye = (aboutX * aboutY).t();
    const std::vector<cv::Vec3d> points = surfaces(frame);
    ASSERT_GT(points.size(), 20000u);
    size_t onFaces = 0, onFirstFace = 0;
    for (const cv::Vec3d& eye : points) {
        const cv::Vec3d p = gearFromEye * (eye + cv::Vec3d(0, 0, 40));
        EXPECT_LT(std::abs(p[2]), 1 + .002) << "thicker than the thickest gear";
        // 24 bits of depth are 2e-5 at 40; one pixel is .04.
        for (double face : {.5, 1., .25}) onFaces += std::abs(p[2] - face) < .002;
        if (std::abs(p[2] - .5) < .002 && std::hypot(p[0] + 3, p[1] + 2) < 4.4) onFirstFace++;
        const double fromFirst = std::hypot(p[0] + 3, p[1] + 2),
                     fromSecond = std::hypot(p[0] - 3.1, p[1] + 2),
                     fromThird = std::hypot(p[0] + 3.1, p[1] - 4.2);
        EXPECT_TRUE(fromFirst < 4.36 || fromSecond < 2.36 || fromThird < 2.36)
            << testing::PrintToString(std::array{p[0], p[1], p[2]});
        if (HasFailure()) break;
    }
    EXPECT_GT(onFaces, points.size() * 6 / 10) << "most of what is seen are the gears' front faces";
    EXPECT_GT(onFirstFace, points.size() / 4);
}

// Neverball (SDL, dlopened OpenGL): its planes are .1 and 512, its view 50° high, its floors flat.
TEST(Capture, NeverballFloorIsFlat) {
    if (!hasProgram("/usr/games/neverball")) GTEST_SKIP() << "no neverball here";
    const ScratchFolder folder;
    const RunOutput run = runCommand("mkdir " + folder.path() + "/home && HOME=" + folder.path() +
                                     "/home SDL_AUDIODRIVER=dummy " +
                                     captured("--every 3 --count 1 --then-quit -o " + folder.path(),
                                              "/usr/games/neverball -l map-easy/bumper.sol"));
    const std::string file = folder / "frame_00003.png";
    ASSERT_TRUE(std::filesystem::exists(file)) << run.text;
    const FramePair frame = brume::readFrame(file);
    const nlohmann::json& depth = (*frame.extras)["depth"];
    EXPECT_NEAR(depth["near"].get<double>(), .1, 1e-6);
    EXPECT_NEAR(depth["far"].get<double>(), 512, .2);  // 2e-7 of the matrix's 1 - 2n/f is 3e-4 of f
    EXPECT_NEAR(2 * std::atan(frame.size().height / 2. / frame.camera.fy) * 180 / CV_PI, 50, .01);

    const std::vector<cv::Vec3d> points = surfaces(frame);
    ASSERT_GT(points.size(), frame.depth.total() / 10);
    // The plane through three points that most others lie in.
    uint64_t state = 1;
    const auto pick = [&] {
        state = state * 6364136223846793005ull + 1442695040888963407ull;
        return points[(state >> 33) % points.size()];
    };
    size_t most = 0;
    cv::Vec3d normal;
    for (int tried = 0; tried < 200; tried++) {
        const cv::Vec3d a = pick(), cross = (pick() - a).cross(pick() - a);
        if (cv::norm(cross) < 1e-2) continue;
        const cv::Vec3d unit = cv::normalize(cross);
        size_t near = 0;
        for (const cv::Vec3d& p : points) near += std::abs((p - a).dot(unit)) < .01;
        if (near > most) {
            most = near;
            normal = unit;
        }
    }
    EXPECT_GT(most, points.size() * 6 / 10) << "of " << points.size();
    EXPECT_LT(std::abs(normal[0]), .01) << "the camera stands level and looks along the board";
}

TEST(Capture, CoreProfileThroughEglWithItsOwnFramebuffer) {
    if (!hasProgram("xvfb-run")) GTEST_SKIP() << "no xvfb-run here";
    const ScratchFolder folder;
    const RunOutput run =
        runCommand(captured("--every 6 --count 1 -o " + folder.path(), binFolder + "/core_program"));
    const std::string file = folder / "frame_00006.png";
    ASSERT_TRUE(std::filesystem::exists(file)) << run.text;
    const FramePair frame = brume::readFrame(file);
    EXPECT_NEAR((*frame.extras)["depth"]["near"].get<double>(), .25, 1e-5);
    EXPECT_NEAR((*frame.extras)["depth"]["far"].get<double>(), 80, .05);
    EXPECT_NEAR(frame.camera.fy, 1.5 * 200 / 2, 1e-3);
    EXPECT_NEAR(frame.camera.fx, 1.5 * 200 / 2, 1e-3);
    EXPECT_NEAR(frame.depth.at<float>(100, 160), 3, 1e-4);
    EXPECT_NEAR(frame.depth.at<float>(20, 160), 7, 1e-3);
    EXPECT_GT(frame.color.at<cv::Vec4f>(100, 160)[0], .5);
    EXPECT_LT(frame.color.at<cv::Vec4f>(100, 160)[1], .05);
    // The square's edges: ±.5 of the axis at Z = 3.
    const double half = .5 / 3 * frame.camera.fx;
    EXPECT_NEAR(frame.depth.at<float>(100, int(160 + half - 1)), 3, 1e-4);
    EXPECT_NEAR(frame.depth.at<float>(100, int(160 + half + 1)), 7, 1e-3);
}
