// The frames that regimes are swept on: small, generic scenes that a header bends to its stress.
#include <cmath>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "error.hpp"
#include "frame/depth_encoding.hpp"
#include "measure/stability.hpp"
#include "nearest_name.hpp"

namespace brume {

using json = nlohmann::json;

namespace {

constexpr float inf = std::numeric_limits<float>::infinity();

struct Description {
    std::string scene = "wall";
    cv::Size size{12, 8};
    double view = 60;  ///< degrees, horizontal
    double rise = 0;   ///< m: how far the topmost ray climbs until `depth`; 0: square pixels
    cv::Vec3d eye{0, 1.6, 0};
    double yaw = 0, pitch = 0;  ///< degrees
    double depth = 100;         ///< m, planar, of the wall
    double exposure = 1;        ///< multiplies colour
    double time = 0;            ///< s
};

cv::Matx44d poseOf(const Description& d) {
    const double a = d.yaw * CV_PI / 180, b = d.pitch * CV_PI / 180;
    const cv::Matx44d yaw{std::cos(a),  0, std::sin(a), 0, 0, 1, 0, 0,
                          -std::sin(a), 0, std::cos(a), 0, 0, 0, 0, 1};
    const cv::Matx44d pitch{1, 0, 0, 0, 0, std::cos(b), -std::sin(b), 0, 0, std::sin(b), std::cos(b),
                            0, 0, 0, 0, 1};
    cv::Matx44d pose = yaw * pitch;
    for (int k = 0; k < 3; k++) pose(k, 3) = d.eye[k];
    return pose;
}

// Dark, middle and bright greys and colours side by side: sRGB's slope makes the dark ones the strictest.
cv::Vec4f patch(int i, int j) {
    const cv::Vec4f patches[] = {
        {0, 0, 0, 1}, {.02f, .05f, .01f, 1}, {.2f, .18f, .15f, 1}, {.9f, .8f, .6f, 1}, {.05f, .3f, .7f, .5f}};
    return patches[(i + 2 * j) % 5];
}

// depth and colour of a pixel, by scene.
using Scene = std::pair<float, cv::Vec4f> (*)(const Description&, const Camera&, int i, int j);

const std::vector<std::pair<std::string, Scene>> scenes = {
    // all of it at one planar depth
    {"wall", [](const Description& d, const Camera&, int i,
                int j) { return std::pair(float(d.depth), patch(i, j)); }},
    // a wall askew, from one planar depth to half as far again, no two columns in step with a depth buffer
    {"slope",
     [](const Description& d, const Camera&, int i, int j) {
         const double share = (i + .5 * std::sqrt(.5 + j)) / (d.size.width + .5 * std::sqrt(d.size.height));
         return std::pair(float(d.depth * (1 + .5 * share)), patch(i, j));
     }},
    // all of it at one distance along the ray
    {"dome", [](const Description& d, const Camera& camera, int i,
                int j) { return std::pair(float(d.depth / cv::norm(camera.ray(i, j))), patch(i, j)); }},
    // level ground 1.6 m below the eye, a wall on the right, sky
    {"ground",
     [](const Description& d, const Camera& camera, int i, int j) {
         const cv::Vec3d ray = camera.ray(i, j);
         const auto& m = camera.worldFromCamera;
         const double up = m(1, 0) * ray[0] + m(1, 1) * ray[1] + m(1, 2) * ray[2];
         double depth = up < 0 ? 1.6 / -up : HUGE_VAL;
         if (3 * i > 2 * d.size.width) depth = std::min(depth, d.depth);
         return std::pair(float(depth), patch(i, j));
     }},
    // from 5 cm to 5 km by columns, the last is sky
    {"depths",
     [](const Description& d, const Camera&, int i, int j) {
         const double share = double(i) / std::max(1, d.size.width - 2);
         return std::pair(i + 1 == d.size.width && i > 0 ? inf : float(.05 * std::pow(1e5, share)),
                          patch(i, j));
     }},
    // lamps of 1 before a dark wall: single pixels near the corners, bars, a bright half at the right
    {"lamps",
     [](const Description& d, const Camera&, int i, int j) {
         const int w = d.size.width, h = d.size.height;
         const bool isPoint = (i == w / 8 && j == h / 2) || (i == 0 && j == 0);
         const bool isBar = i > w / 3 && i <= w / 3 + std::max(1, w / 16);
         const bool isHalf = i > 5 * w / 6;
         return std::pair(float(d.depth), isPoint || isBar || isHalf ? cv::Vec4f(1, .9f, .7f, 1)
                                                                     : cv::Vec4f(.01f, .02f, .03f, 1));
     }},
    // one lamp in the middle of black
    {"lamp",
     [](const Description& d, const Camera&, int i, int j) {
         const bool isLamp = i == d.size.width / 2 && j == d.size.height / 2;
         return std::pair(float(d.depth), isLamp ? cv::Vec4f(1, 1, 1, 1) : cv::Vec4f(0, 0, 0, 1));
     }},
};

cv::Mat ramp(cv::Size size) {
    cv::Mat image(size, CV_32FC4);
    for (int j = 0; j < size.height; j++)
        for (int i = 0; i < size.width; i++) {
            const float share = size.width > 1 ? float(i) / float(size.width - 1) : .5f;
            image.at<cv::Vec4f>(j, i) = {share, share, share, 1};
        }
    return image;
}

double number(const json& item, const std::string& where, const std::string& key) {
    if (!item.is_number()) failUsage(where, ": ", key, " must be a number or an expression of $stress");
    return item.get<double>();
}

// What a depth buffer of so many bits keeps of `depth`: unsigned fractions of 16 or 24 bits, or 32-bit
// floats.
cv::Mat quantised(const cv::Mat& depth, const Camera& camera, const json& item, const std::string& where) {
    DepthEncoding encoding;
    encoding.kind = DepthEncoding::Kind::Device;
    double bits = 24;
    for (const auto& [key, value] : item.items()) {
        if (key == "BITS")
            bits = number(value, where, key);
        else if (key == "NEAR")
            encoding.nearPlane = number(value, where, key);
        else if (key == "FAR")
            encoding.farPlane = value == "infinite" ? HUGE_VAL : number(value, where, key);
        else if (key == "REVERSED")
            encoding.reversed = value.get<bool>();
        else
            failUsage(where, ": STORED: unknown key '", key, "'",
                      suggestion(key, {"BITS", "NEAR", "FAR", "REVERSED"}));
    }
    const double steps = std::pow(2., bits) - 1;
    cv::Mat stored(depth.size(), CV_32F);
    for (int j = 0; j < depth.rows; j++)
        for (int i = 0; i < depth.cols; i++) {
            const double device = encodeDepth(depth.at<float>(j, i), encoding);
            stored.at<float>(j, i) = float(bits < 32 ? std::round(device * steps) / steps : device);
        }
    return decodeDepth(stored, encoding, camera);
}

}  // namespace

ProbeFrame probeFrame(const json& description, const std::string& where) {
    Description d;
    json stored, pixel;
    const std::vector<std::pair<std::string, std::function<void(const json&, const std::string&)>>> keys = {
        {"SCENE", [&](const json& v, auto&) { d.scene = v.get<std::string>(); }},
        {"WIDTH", [&](const json& v, auto& key) { d.size.width = int(number(v, where, key)); }},
        {"HEIGHT", [&](const json& v, auto& key) { d.size.height = int(number(v, where, key)); }},
        {"VIEW", [&](const json& v, auto& key) { d.view = number(v, where, key); }},
        {"RISE", [&](const json& v, auto& key) { d.rise = number(v, where, key); }},
        {"EYE",
         [&](const json& v, auto& key) {
             if (!v.is_array() || v.size() != 3) failUsage(where, ": EYE must be three numbers");
             for (int k = 0; k < 3; k++) d.eye[k] = number(v[k], where, key);
         }},
        {"YAW", [&](const json& v, auto& key) { d.yaw = number(v, where, key); }},
        {"PITCH", [&](const json& v, auto& key) { d.pitch = number(v, where, key); }},
        {"DEPTH", [&](const json& v, auto& key) { d.depth = number(v, where, key); }},
        {"EXPOSURE", [&](const json& v, auto& key) { d.exposure = number(v, where, key); }},
        {"TIME", [&](const json& v, auto& key) { d.time = number(v, where, key); }},
        {"PIXEL", [&](const json& v, auto&) { pixel = v; }},    // colour of the middle pixel
        {"STORED", [&](const json& v, auto&) { stored = v; }},  // what a depth buffer keeps
    };
    std::vector<std::string> known;
    for (const auto& [key, read] : keys) known.push_back(key);
    for (const auto& [name, value] : description.items()) {
        auto key = std::find_if(keys.begin(), keys.end(), [&, n = name](auto& k) { return k.first == n; });
        if (key == keys.end()) failUsage(where, ": unknown key '", name, "'", suggestion(name, known));
        key->second(value, name);
    }
    auto scene = std::find_if(scenes.begin(), scenes.end(), [&](auto& s) { return s.first == d.scene; });
    if (scene == scenes.end()) {
        known.clear();
        for (const auto& [name, make] : scenes) known.push_back(name);
        failUsage(where, ": no SCENE '", d.scene, "'", suggestion(d.scene, known));
    }
    if (d.size.width < 1 || d.size.height < 1 || d.size.area() > 1 << 20)
        failUsage(where, ": a frame of ", d.size.width, "×", d.size.height, " px; at most 2^20 of them");

    ProbeFrame probe;
    FramePair& frame = probe.frame;
    frame.name = d.scene;
    frame.time = d.time;
    frame.camera = Camera::withHorizontalView(d.size, d.view);
    if (d.rise > 0) frame.camera.fy = .5 * (d.size.height - 1) * d.depth / d.rise;
    frame.camera.worldFromCamera = poseOf(d);
    frame.color.create(d.size, CV_32FC4);
    frame.depth.create(d.size, CV_32F);
    for (int j = 0; j < d.size.height; j++)
        for (int i = 0; i < d.size.width; i++) {
            auto [depth, color] = scene->second(d, frame.camera, i, j);
            for (int c = 0; c < 3; c++) color[c] *= float(d.exposure);
            frame.depth.at<float>(j, i) = depth;
            frame.color.at<cv::Vec4f>(j, i) = color;
        }
    if (!pixel.is_null()) {
        const float value = float(number(pixel, where, "PIXEL"));
        frame.color.at<cv::Vec4f>(d.size.height / 2, d.size.width / 2) = {value, value, value, 1};
    }
    frame.images["ramp"] = ramp(d.size);
    probe.truth = frame.depth;
    if (!stored.is_null()) frame.depth = quantised(probe.truth, frame.camera, stored, where + ": STORED");
    return probe;
}

}  // namespace brume
