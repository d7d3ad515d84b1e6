// The frames every effect is checked on.
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "measure/check.hpp"

namespace brume {
namespace {

constexpr float inf = std::numeric_limits<float>::infinity();

cv::Matx44d rotationX(double degrees) {
    double a = degrees * CV_PI / 180, c = std::cos(a), s = std::sin(a);
    return {1, 0, 0, 0, 0, c, -s, 0, 0, s, c, 0, 0, 0, 0, 1};
}

cv::Matx44d rotationY(double degrees) {
    double a = degrees * CV_PI / 180, c = std::cos(a), s = std::sin(a);
    return {c, 0, s, 0, 0, 1, 0, 0, -s, 0, c, 0, 0, 0, 0, 1};
}

cv::Matx44d poseAt(cv::Vec3d eye, double yaw, double pitch) {
    cv::Matx44d pose = rotationY(yaw) * rotationX(pitch);
    for (int k = 0; k < 3; k++) pose(k, 3) = eye[k];
    return pose;
}

// A frame of random colours (one in ten HDR up to 100, one in a hundred up to 1e4) and log-uniform depths
// with some sky.
CheckFrame randomFrame(const std::string& name, cv::Size size, double view, uint64_t seed) {
    cv::RNG random(seed);
    CheckFrame made;
    made.name = name;
    FramePair& frame = made.frame;
    frame.name = name;
    frame.camera = Camera::withHorizontalView(size, view);
    frame.color.create(size, CV_32FC4);
    frame.depth.create(size, CV_32F);
    for (int j = 0; j < size.height; j++)
        for (int i = 0; i < size.width; i++) {
            int kind = random.uniform(0, 100);
            float scale = kind == 0 ? 1e4f : kind < 10 ? 100.0f : 1.0f;
            cv::Vec4f& color = frame.color.at<cv::Vec4f>(j, i);
            for (int c = 0; c < 3; c++) color[c] = scale * random.uniform(0.0f, 1.0f);
            color[3] = random.uniform(0, 4) ? 1.0f : random.uniform(0.0f, 1.0f);
            float depth = .05f * std::pow(1e5f, random.uniform(0.0f, 1.0f));
            frame.depth.at<float>(j, i) = random.uniform(0, 100) < 15 ? inf : depth;
        }
    // Moments and seeds differ from frame to frame, as in a sequence.
    frame.time = random.uniform(0.0, 100.0);
    frame.index = random.uniform(0, 1000);
    frame.seed = uint32_t(random.uniform(0, 1 << 30));
    return made;
}

CheckFrame depthClasses() {
    CheckFrame made = randomFrame("depth_classes", {24, 16}, 70, 11);
    made.frame.camera.worldFromCamera = Camera::standing(1.6, -20);
    const float classes[] = {0,  1e-40f, 1e-30f, 1e-6f, 1e-3f, .1f,   1,
                             10, 100,    1e3f,   1e6f,  1e9f,  1e20f, std::numeric_limits<float>::max(),
                             inf};
    int k = 0;
    for (float& depth : cv::Mat_<float>(made.frame.depth)) depth = classes[k++ % std::size(classes)];
    return made;
}

// Greys that people choose as thresholds, in linear and encoded form, one ulp below and above. Few pixels:
// where a comparison decides, they are left out.
CheckFrame greys() {
    const float thresholds[] = {.18f, .5f, .7f, .8f, .9f, 1.0f, .21404114f, .60382734f};
    CheckFrame made = randomFrame("greys", {3, int(std::size(thresholds))}, 60, 13);
    for (int j = 0; j < made.frame.color.rows; j++)
        for (int i = 0; i < 3; i++) {
            float grey = i == 1 ? thresholds[j] : std::nextafter(thresholds[j], i ? inf : -inf);
            made.frame.color.at<cv::Vec4f>(j, i) = {grey, grey, grey, 1};
        }
    return made;
}

// Near, dark things before a bright, far background: one column, and a block.
CheckFrame silhouette() {
    CheckFrame made = randomFrame("silhouette", {40, 30}, 60, 17);
    FramePair& frame = made.frame;
    for (int j = 0; j < frame.color.rows; j++)
        for (int i = 0; i < frame.color.cols; i++) {
            bool near = i == 20 || (i < 8 && j > 14);
            frame.color.at<cv::Vec4f>(j, i) =
                near ? cv::Vec4f(.02f, .03f, .01f, 1) : cv::Vec4f(.7f, .8f, 1, 1);
            frame.depth.at<float>(j, i) = near ? 2.0f : j < 12 ? inf : 400.0f;
        }
    return made;
}

// Colours that a capture may hold and arithmetic stumbles on, one pixel each.
CheckFrame specials() {
    CheckFrame made = randomFrame("specials", {16, 12}, 60, 19);
    made.finiteColor = false;
    const float values[] = {std::numeric_limits<float>::quiet_NaN(), inf, 65504, 1e6f, -.25f, 1e-40f, 0};
    int k = 0;
    for (float value : values) {
        made.frame.color.at<cv::Vec4f>(3 + k % 2 * 5, 1 + 2 * k) = {value, value, .5f, 1};
        k++;
    }
    return made;
}

// A ground plane, a wall and sky as a level camera sees them: smooth, with real heights and a horizon.
CheckFrame ground() {
    CheckFrame made = randomFrame("ground", {64, 48}, 90, 23);
    FramePair& frame = made.frame;
    for (int j = 0; j < frame.color.rows; j++)
        for (int i = 0; i < frame.color.cols; i++) {
            double down = -frame.camera.ray(i, j)[1];
            double depth = down > 0 ? frame.camera.eye()[1] / down : inf;
            if (i > 40 && depth > 25) depth = 25;
            float u = float(i) / 64, v = float(j) / 48;
            frame.color.at<cv::Vec4f>(j, i) = {.2f + .3f * u, .3f + .2f * v, .5f - .3f * v, 1};
            frame.depth.at<float>(j, i) = float(depth);
        }
    return made;
}

}  // namespace

std::vector<CheckFrame> checkFrames() {
    std::vector<CheckFrame> frames;
    frames.push_back(randomFrame("random", {64, 48}, 60, 1));
    frames.push_back(depthClasses());
    frames.push_back(ground());
    frames.push_back(silhouette());
    frames.push_back(greys());
    frames.push_back(specials());
    frames.push_back(randomFrame("single", {1, 1}, 60, 2));
    frames.push_back(randomFrame("row", {37, 1}, 60, 3));
    frames.push_back(randomFrame("column", {1, 29}, 5, 4));
    frames.push_back(randomFrame("odd_wide", {33, 17}, 110, 5));
    frames.push_back(randomFrame("narrow_up", {3, 48}, 10, 6));
    frames.back().frame.camera.worldFromCamera = Camera::standing(30, 35);
    frames.push_back(randomFrame("far_off", {21, 14}, 75, 7));
    frames.back().frame.camera.worldFromCamera = poseAt({1e6, 250, -2e6}, 40, -12);
    // A principal point off the middle and unequal focal lengths, as calibrated cameras have them.
    frames.push_back(randomFrame("off_centre", {19, 23}, 50, 8));
    frames.back().frame.camera.cx += 3.25;
    frames.back().frame.camera.cy -= 1.5;
    frames.back().frame.camera.fy *= 1.1;
    return frames;
}

}  // namespace brume
