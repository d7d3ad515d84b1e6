// The picture that MODELS.md's sums give, added up slowly in world space by code of its own: reference and
// halves share derived constants and conventions, so a mistake in those would pass between them.
#include <nlohmann/json.hpp>

#include "common/noise_reference.hpp"
#include "error.hpp"
#include "fog_fixture.hpp"
#include "gl/gl_runner.hpp"

namespace brume {
namespace {

enum Falloff { none, linear, exponential };
const char* const falloffNames[] = {"none", "linear", "exponential"};

// What is left of the density `beyond` metres behind a falloff's start (P2 §4.1.2).
double leftOf(Falloff falloff, double beyond, double distance) {
    if (falloff == none || beyond <= 0) return 1;
    return falloff == linear ? std::max(0., 1 - beyond / distance) : std::exp(-7.5 * beyond / distance);
}

struct Model {
    std::string name, phase = "isotropic", noise = "none";
    double anisotropy = 0;
    Falloff sceneHeight = linear, boxHeight = exponential, boxEdges = linear;
    double boxFalloffDistance = 5;
    bool hasShadow = false;

    // 1/sr, of the angle between the view ray and the direction towards the light.
    double scattered(double cosine) const {
        const double g = anisotropy;
        if (phase == "rayleigh") return 3 / (16 * CV_PI) * (1 + cosine * cosine);
        if (phase == "isotropic") return 1 / (4 * CV_PI);
        return (1 - g * g) / (4 * CV_PI * std::pow(1 + g * g - 2 * g * cosine, 1.5));
    }
};

const cv::Vec3d sun(.48, .6, -.64), sunColor(2, 1.5, 1), ambient(.2, .3, .4), wind(2, .5, -1);
const cv::Vec3d boxCenter(1, 4, -20), boxSize(30, 9, 24), lampAt(3, 3, -14), lampColor(12, 9, 6);
const cv::Vec3d sceneAlbedo(.5, .9, 1), boxAlbedo(.9, .8, .7);

std::string presetOf(const Model& m) {
    return text(R"({"effect": "volume_fog", "method": "midpoint", "steps": 512, "early_stop": false,
        "density": 0.004, "albedo": [0.5, 0.9, 1], "height_start": 3, "height_distance": 11, "height_falloff": ")",
                falloffNames[m.sceneHeight],
                R"(", "boxes": [{"center": [1, 4, -20], "size": [30, 9, 24], "density": 0.06,
        "albedo": [0.9, 0.8, 0.7], "height_start": 1.5, "edge_start_x": 30, "edge_start_z": 60, "height_falloff": ")",
                falloffNames[m.boxHeight], R"(", "height_distance": )", m.boxFalloffDistance,
                R"(, "edge_falloff": ")", falloffNames[m.boxEdges],
                R"("}], "point_lights": [{"position": [3, 3, -14], "color": [12, 9, 6],
        "intensity": 1.5, "range": 14, "attenuation": [1, 0.2, 0.5]}],
        "sun_direction": [0.48, 0.6, -0.64], "sun_color": [2, 1.5, 1], "sun_intensity": 1.25, "ambient": [0.2, 0.3, 0.4],
        "ambient_intensity": 0.8, "shadow_strength": 0.75, "shadow_bias": 0.5, "noise_size": 9, "noise_seed": 7,
        "noise_strength": 0.8, "wind": [2, 0.5, -1], "noise": ")",
                m.noise, R"(", "phase": ")", m.phase, R"(", "anisotropy": )", m.anisotropy, "}");
}

// Surfaces at heights 4 and, to the right, none: what lies lower, by more than the bias, is in shadow.
bool isInShadow(const cv::Vec3d& q) { return q[0] < 0 && q[1] < 4 - .5; }
void addShadow(FramePair& frame) {
    cv::Mat map(8, 8, CV_32F, cv::Scalar(1));
    map.colRange(0, 4).setTo(.46);  // δ = .5 - y/100
    frame.images["sun.exr"] = map;
    frame.extras = std::make_shared<const nlohmann::json>(nlohmann::json::parse(
        R"({"lights": [{"type": "directional", "direction": [0.48, 0.6, -0.64], "shadow_map": "sun.exr",
            "world_to_shadow": [0.001, 0, 0, 0.5,  0, 0, 0.001, 0.5,  0, -0.01, 0, 0.5,  0, 0, 0, 1]}]})"));
}

double density(const Model& m, double time, const cv::Vec3d& q, cv::Vec3d& albedo) {
    const double scene = .004 * leftOf(m.sceneHeight, q[1] - 3, 11);
    double box = 0;
    const cv::Vec3d away = q - boxCenter;
    if (std::abs(away[0]) < 15 && std::abs(away[1]) < 4.5 && std::abs(away[2]) < 12)
        box = .06 * leftOf(m.boxHeight, q[1] - (-.5 + 1.5), std::min(m.boxFalloffDistance, 9 - 1.5)) *
              leftOf(m.boxEdges, std::abs(away[0]) - .3 * 15, .7 * 15) *
              leftOf(m.boxEdges, std::abs(away[2]) - .6 * 12, .4 * 12);
    double factor = 1;
    if (m.noise != "none") {
        const double n = reference::noise(NoiseKind::Simplex, (q - wind * time) * (1 / 9.), 1, 1024, 7);
        factor = m.noise == "additive" ? 1 + .8 * n : 1 - .8 * n;
    }
    albedo = (sceneAlbedo * scene + boxAlbedo * box) * (1 / std::max(scene + box, 1e-300));
    return (scene + box) * factor;
}

cv::Vec3d seen(const Model& m, const FramePair& frame, int i, int j, int steps) {
    const cv::Vec3d ray = frame.camera.ray(i, j), eye = frame.camera.eye();
    cv::Vec3d d = frame.camera.worldFromCamera.get_minor<3, 3>(0, 0) * ray * (1 / cv::norm(ray));
    const double step = frame.depth.at<float>(j, i) * cv::norm(ray) / steps;
    double through = 1;
    cv::Vec3d gained;
    for (int k = 0; k < steps; k++) {
        const cv::Vec3d q = eye + d * ((k + .5) * step), towards = lampAt - q;
        cv::Vec3d albedo;
        const double opacity = -std::expm1(-density(m, frame.time, q, albedo) * step), r = cv::norm(towards);
        // A white surface that faces a light of colour c is seen as c: irradiance π·c.
        const double sunlit = m.hasShadow && isInShadow(q) ? 1 - .75 : 1;
        cv::Vec3d light = ambient * .8 + sunColor * (1.25 * sunlit * CV_PI * m.scattered(d.dot(sun)));
        if (r < 14)
            light += lampColor * (1.5 / (1 + .2 * r + .5 * r * r) * CV_PI * m.scattered(d.dot(towards) / r));
        gained += albedo.mul(light) * (through * opacity);
        through *= 1 - opacity;
    }
    cv::Vec3d color = gained;
    for (int n = 0; n < 3; n++) color[n] += through * double(frame.color.at<cv::Vec4f>(j, i)[n]);
    return color;
}

TEST(VolumeFogModel, ThePictureIsTheModelsSum) {
    std::vector<Model> models(7);
    models[0] = {"isotropic"};
    models[1] = {"forward", "henyey-greenstein", "none", .4, exponential, linear, exponential, 5};
    models[2] = {"backward", "henyey-greenstein", "none", -.5, none, linear, none,
                 100};  // cut at the box's top
    models[3] = {"rayleigh", "rayleigh", "none", 0, linear, exponential, exponential, 100};
    models[4] = {"additive noise", "isotropic", "additive", 0, none, none, none};
    models[5] = {"subtractive noise", "isotropic", "subtractive", 0, none, none, none};
    models[6] = {"shadow", "isotropic", "none", 0, none, none, none, 5, true};
    const auto cpu = makeCpuRunner(), gl = makeGlRunner();
    for (const Model& m : models) {
        FramePair frame = fogFrame({12, 8});
        cv::RNG(6).fill(frame.depth, cv::RNG::UNIFORM, 8, 60);
        frame.camera.worldFromCamera = Camera::standing(1.6, 3);
        frame.time = 3;
        if (m.hasShadow) addShadow(frame);
        const Chain chain = withSidecar(
            parsePreset("{\"effects\": [" + presetOf(m) + "]}", "test", EffectRegistry::standard()), frame);
        const cv::Mat onCpu = cpu->run(chain, frame, {}).images.at("color").clone(),
                      onGl = gl->run(chain, frame, {}).images.at("color").clone();
        double worst = 0;
        for (int k = 0; k < 96; k += m.noise == "none" ? 3 : 11) {
            const cv::Vec3d truth = seen(m, frame, k % 12, k / 12, 3000);
            for (const cv::Mat& image : {onCpu, onGl})
                for (int n = 0; n < 3; n++)
                    worst = std::max(worst, std::abs(image.at<cv::Vec4f>(k / 12, k % 12)[n] - truth[n]) /
                                                std::max(truth[n], .1));
        }
        // Neither the sum's stretches nor, at a shadow's edge, the march's steps end at walls; measured:
        // .0004, .0010 with shadows.
        EXPECT_LT(worst, m.hasShadow ? 4e-3 : 1e-3) << m.name;
    }
}

}  // namespace
}  // namespace brume
