// The sample scenes as brume reads them: what is known of their geometry must come back from the captures.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "frame/read.hpp"
#include "run.hpp"

namespace {

using brume::FramePair;

RunOutput render(const std::string& arguments) {
    return runCommand(binFolder + "/brume_scenes " + arguments);
}

cv::Vec3d worldPosition(const FramePair& frame, int i, int j) {
    const cv::Vec3d p = frame.camera.ray(i, j) * double(frame.depth.at<float>(j, i));
    const cv::Vec4d world = frame.camera.worldFromCamera * cv::Vec4d(p[0], p[1], p[2], 1);
    return {world[0], world[1], world[2]};
}

template <class Visit>
void eachSurface(const FramePair& frame, const Visit& visit) {
    for (int j = 0; j < frame.depth.rows; j++)
        for (int i = 0; i < frame.depth.cols; i++)
            if (std::isfinite(frame.depth.at<float>(j, i))) visit(i, j, worldPosition(frame, i, j));
}

double luminance(const FramePair& frame, int i, int j) {
    const cv::Vec4f c = frame.color.at<cv::Vec4f>(j, i);
    return .2126 * c[0] + .7152 * c[1] + .0722 * c[2];
}

std::string bytesOf(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

// All scenes once, small; and two frames of each.
class Scenes : public testing::TestWithParam<const char*> {
  protected:
    static void SetUpTestSuite() {
        folder_ = new ScratchFolder;
        const RunOutput run = render("--size 192x108 --frames 2 -o " + folder_->path());
        ASSERT_EQ(run.status, 0) << run.text;
    }
    static void TearDownTestSuite() { delete folder_; }
    static FramePair frame(const std::string& scene, int index = 0) {
        return brume::readFrame(*folder_ / (scene + "_000" + std::to_string(index) + ".exr"));
    }
    static ScratchFolder* folder_;
};
ScratchFolder* Scenes::folder_ = nullptr;

}  // namespace

TEST_P(Scenes, AreWholePictures) {
    const FramePair pair = frame(GetParam());
    ASSERT_EQ(pair.size(), cv::Size(192, 108));
    size_t sky = 0;
    for (int j = 0; j < 108; j++) {
        for (int i = 0; i < 192; i++) {
            const float z = pair.depth.at<float>(j, i);
            sky += std::isinf(z);
            ASSERT_TRUE(z > .1f) << i << ", " << j;
            for (int k = 0; k < 3; k++) {
                const float value = pair.color.at<cv::Vec4f>(j, i)[k];
                ASSERT_TRUE(value >= 0 && value < 1000) << i << ", " << j;
            }
        }
    }
    EXPECT_GT(sky, size_t(192 * 108 / 20));
    EXPECT_LT(sky, size_t(192 * 108 / 2));
    double mean = 0;
    for (int j = 0; j < 108; j++)
        for (int i = 0; i < 192; i++) mean += std::min(1., luminance(pair, i, j)) / (192 * 108);
    const bool night = std::string(GetParam()) == "street_night";
    EXPECT_GT(mean, night ? .01 : .1);
    EXPECT_LT(mean, night ? .15 : .5);
}

// A point seen from the start of the path is, from its end, seen at the same place, or hidden, or out of
// view: never looked through.
TEST_P(Scenes, StandStillWhileTheCameraMoves) {
    const FramePair a = frame(GetParam(), 0), b = frame(GetParam(), 1);
    EXPECT_GT(cv::norm(a.camera.eye() - b.camera.eye()), 5);
    EXPECT_EQ(b.time - a.time, 1 / 25.);
    const cv::Matx44d fromWorld = b.camera.worldFromCamera.inv();
    size_t same = 0, lookedThrough = 0, compared = 0;
    eachSurface(a, [&](int, int, cv::Vec3d world) {
        const cv::Vec4d p = fromWorld * cv::Vec4d(world[0], world[1], world[2], 1);
        if (p[2] > -1) return;
        const double x = p[0] / -p[2] * b.camera.fx + b.camera.cx,
                     y = -p[1] / -p[2] * b.camera.fy + b.camera.cy;
        const int i = int(std::floor(x)), j = int(std::floor(y));
        if (i < 2 || j < 2 || i > 189 || j > 105) return;
        compared++;
        // The nearest and farthest around, since its pixel's centre looks beside the point.
        double least = INFINITY, most = 0;
        for (int dj = -1; dj <= 1; dj++) {
            for (int di = -1; di <= 1; di++) {
                least = std::min<double>(least, b.depth.at<float>(j + dj, i + di));
                most = std::max<double>(most, b.depth.at<float>(j + dj, i + di));
            }
        }
        same += least * .99 <= -p[2] && -p[2] <= most * 1.01;
        lookedThrough += least > -p[2] * 1.02;
    });
    ASSERT_GT(compared, 1000u);
    // Grass and twigs thinner than a pixel are seen from one place and missed from another.
    EXPECT_LT(lookedThrough, compared / 50);
    EXPECT_GT(same, compared / 2);
}

// What the sun's map says is in shadow is darker than what it says is lit.
TEST_P(Scenes, SunsMapAgreesWithTheShadows) {
    const FramePair pair = frame(GetParam());
    const nlohmann::json& sun = (*pair.extras)["lights"][0];
    ASSERT_EQ(sun["type"], "directional");
    const cv::Mat map = brume::readImage(*folder_ / sun["shadow_map"].get<std::string>());
    ASSERT_EQ(map.type(), CV_32F);
    cv::Matx44d worldToShadow;
    for (int k = 0; k < 16; k++) worldToShadow.val[k] = sun["world_to_shadow"][k];
    const cv::Vec3d direction(sun["direction"][0], sun["direction"][1], sun["direction"][2]);
    EXPECT_NEAR(cv::norm(direction), 1, 1e-6);

    // Going towards the sun changes neither u nor v, and brings the depth nearer to 0.
    const cv::Vec4d step = worldToShadow * cv::Vec4d(direction[0], direction[1], direction[2], 0);
    EXPECT_NEAR(step[0], 0, 1e-9);
    EXPECT_NEAR(step[1], 0, 1e-9);
    EXPECT_LT(step[2], 0);

    std::vector<double> lit, shaded;
    size_t missing = 0;
    eachSurface(pair, [&](int i, int j, cv::Vec3d world) {
        const cv::Vec4d s = worldToShadow * cv::Vec4d(world[0], world[1], world[2], 1);
        const int u = int(std::floor(s[0] * map.cols)), v = int(std::floor(s[1] * map.rows));
        if (u < 1 || v < 1 || u + 1 >= map.cols || v + 1 >= map.rows || s[2] < 0 || s[2] > 1) return;
        double least = 1, most = 0;  // of the texels around: the penumbra is left out
        for (int dv = -1; dv <= 1; dv++) {
            for (int du = -1; du <= 1; du++) {
                least = std::min<double>(least, map.at<float>(v + dv, u + du));
                most = std::max<double>(most, map.at<float>(v + dv, u + du));
            }
        }
        const double bias = .01;
        if (most < s[2] - bias) shaded.push_back(luminance(pair, i, j));
        if (least > s[2] - bias) lit.push_back(luminance(pair, i, j));
        missing += least < 0 || most > 1;
    });
    EXPECT_EQ(missing, 0u);
    ASSERT_GT(lit.size(), 500u);
    if (std::string(GetParam()) == "street_night") return;  // the lamps outshine the moon
    ASSERT_GT(shaded.size(), 500u);
    const auto median = [](std::vector<double>& values) {
        std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
        return values[values.size() / 2];
    };
    EXPECT_GT(median(lit), 1.5 * median(shaded));
}

INSTANTIATE_TEST_SUITE_P(All, Scenes, testing::Values("forest_day", "street_night", "valley"),
                         [](const auto& info) { return std::string(info.param); });

// One plane of known height in each scene.
TEST_F(Scenes, GroundRoadAndWaterAreLevel) {
    const struct {
        const char* scene;
        double share;
    } expected[] = {{"forest_day", .2}, {"street_night", .15}, {"valley", .1}};
    for (const auto& [scene, share] : expected) {
        const FramePair pair = frame(scene);
        size_t level = 0, below = 0;
        eachSurface(pair, [&](int i, int j, cv::Vec3d world) {
            const double tolerance = 1e-3 + 2e-5 * pair.depth.at<float>(j, i);
            level += std::abs(world[1]) < tolerance;
            below += world[1] < -tolerance && pair.depth.at<float>(j, i) < 400;
        });
        EXPECT_GT(level, size_t(share * 192 * 108)) << scene;
        EXPECT_EQ(below, 0u) << scene;
    }
}

TEST_F(Scenes, LampsShineAboveOneAndAreListed) {
    const FramePair street = frame("street_night");
    double brightest = 0;
    for (int j = 0; j < 108; j++)
        for (int i = 0; i < 192; i++) brightest = std::max(brightest, luminance(street, i, j));
    EXPECT_GT(brightest, 5);
    size_t points = 0, seen = 0;
    for (const auto& light : (*street.extras)["lights"]) {
        if (light["type"] != "point") continue;
        points++;
        EXPECT_GT(light["range"].get<double>(), 0);
        const cv::Vec4d world(light["position"][0], light["position"][1], light["position"][2], 1);
        const cv::Vec4d p = street.camera.worldFromCamera.inv() * world;
        const int i = int(p[0] / -p[2] * street.camera.fx + street.camera.cx);
        const int j = int(-p[1] / -p[2] * street.camera.fy + street.camera.cy);
        if (p[2] > -2 || p[2] < -40 || i < 3 || j < 3 || i > 188 || j > 104) continue;
        double around = 0;  // its lamp glows there, unless something stands before it
        for (int dj = -3; dj <= 3; dj++)
            for (int di = -3; di <= 3; di++) around = std::max(around, luminance(street, i + di, j + dj));
        seen += around > 1;
    }
    EXPECT_GE(points, 10u);
    EXPECT_GE(seen, 4u);
}

TEST_F(Scenes, EveryShippedPresetChangesAPicture) {
    size_t presets = 0;
    for (const auto& entry : std::filesystem::directory_iterator(BRUME_SOURCE_DIR "/samples/presets")) {
        if (entry.path().extension() != ".json") continue;
        const std::string name = entry.path().stem().string();
        presets++;
        std::string command = std::string(BRUME_PROGRAM) + " apply " + entry.path().string();
        for (const char* scene : {"forest_day", "street_night", "valley"})
            command += " " + (*folder_ / (std::string(scene) + "_0000.exr"));
        const RunOutput run =
            runCommand(command + " --backend cpu -o " + (*folder_ / (name + "/{stem}.exr")));
        ASSERT_EQ(run.status, 0) << name << ": " << run.text;
        size_t changed = 0;
        for (const char* scene : {"forest_day", "street_night", "valley"}) {
            const FramePair before = frame(scene);
            const cv::Mat after = brume::readImage(*folder_ / (name + "/" + scene + "_0000.exr"));
            ASSERT_EQ(after.size(), before.size());
            const int channels = after.channels();
            for (int j = 0; j < after.rows; j++)
                for (int i = 0; i < after.cols; i++)
                    changed += std::abs(after.ptr<float>(j)[channels * i] -
                                        before.color.at<cv::Vec4f>(j, i)[0]) > 1e-3f;
        }
        EXPECT_GT(changed, size_t(192 * 108 / 20)) << name;
    }
    EXPECT_GE(presets, 5u);
}

TEST_F(Scenes, ContactSheetHoldsItsPictures) {
    const std::string sheet = *folder_ / "sheet.png", picture = *folder_ / "forest_day_0000.exr";
    const std::string program = binFolder + "/brume_contact_sheet";
    RunOutput run =
        runCommand(program + " -o " + sheet + " --title Title --columns 2 --width 96 '# A' one=" + picture +
                   " two=" + picture + " three=" + picture);
    ASSERT_EQ(run.status, 0) << run.text;
    const cv::Mat image = brume::readImage(sheet);
    EXPECT_GT(image.cols, 2 * 96);
    EXPECT_LT(image.cols, 3 * 96);
    EXPECT_GT(image.rows, 2 * 54);
    run = runCommand(program + " -o " + sheet + " one=" + (*folder_ / "missing.png"));
    EXPECT_EQ(run.status, 3);
    EXPECT_NE(run.text.find("missing.png"), std::string::npos) << run.text;
}

TEST(ScenesProgram, TheSameEveryTime) {
    const ScratchFolder a, b;
    ASSERT_EQ(render("--scene forest_day --size 96x54 -o " + a.path()).status, 0);
    ASSERT_EQ(render("--scene forest_day --size 96x54 -o " + b.path()).status, 0);
    for (const char* file :
         {"forest_day.json", "forest_day.exr", "forest_day.depth.exr", "forest_day.sun.exr"}) {
        const std::string bytes = bytesOf(a / file);
        EXPECT_GT(bytes.size(), 1000u) << file;
        EXPECT_TRUE(bytes == bytesOf(b / file)) << file;
    }
}

// Three times the size has a pixel centre at each of the small picture's; 2100 columns need two tiles.
TEST(ScenesProgram, AnySizeShowsTheSameView) {
    const ScratchFolder folder;
    ASSERT_EQ(render("--scene street_night --size 700x21 -o " + (folder / "small")).status, 0);
    ASSERT_EQ(render("--scene street_night --size 2100x63 -o " + (folder / "large")).status, 0);
    ASSERT_EQ(render("--scene street_night --size 1x1 -o " + (folder / "one")).status, 0);
    EXPECT_EQ(brume::readFrame(folder / "one/street_night.exr").size(), cv::Size(1, 1));
    const FramePair small = brume::readFrame(folder / "small/street_night.exr");
    const FramePair large = brume::readFrame(folder / "large/street_night.exr");
    size_t differ = 0, right = 0;
    double colour = 0;
    for (int j = 0; j < 21; j++) {
        for (int i = 0; i < 700; i++) {
            const float a = small.depth.at<float>(j, i), b = large.depth.at<float>(3 * j + 1, 3 * i + 1);
            const bool same = a == b || std::abs(a - b) < 1e-3f * a;
            differ += !same;
            if (3 * i >= 2048) right += same;
            colour += std::abs(luminance(small, i, j) - luminance(large, 3 * i + 1, 3 * j + 1)) / (21 * 700);
        }
    }
    EXPECT_LT(differ, 700u * 21 / 100);  // centres that graze an edge
    EXPECT_GT(right, 17u * 20);          // the second tile's columns
    EXPECT_LT(colour, .1);
}

TEST(ScenesProgram, MistakesAreNamed) {
    RunOutput run = render("--scene forrest_day");
    EXPECT_EQ(run.status, 2);
    EXPECT_NE(run.text.find("forest_day"), std::string::npos) << run.text;
    run = render("--size 1280");
    EXPECT_EQ(run.status, 2);
    EXPECT_NE(run.text.find("\"1280\""), std::string::npos) << run.text;
    run = render("--scene street_night --size 8x8 -o /dev/null/here");
    EXPECT_EQ(run.status, 3);
    EXPECT_NE(run.text.find("/dev/null/here"), std::string::npos) << run.text;
}
