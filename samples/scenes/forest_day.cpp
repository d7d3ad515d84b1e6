// A clearing in a wood on a clear afternoon, after the base scene of Lanman 2018, appendix B: a ground plane,
// 1501 trees of six cylinders each (859 short, 642 tall), four mountains, a shed of boxes, a lamp post.
#include <algorithm>
#include <cmath>

#include "plants.hpp"
#include "scene.hpp"

namespace scenes {
namespace {

constexpr int shortTrees = 859, tallTrees = 642;

// As trailDistance in shaders/surface.glsl.
float trailCentre(float z) {
    const float t = std::clamp(-z, -40.f, 60.f);
    return 2.3f * std::sin(t * .085f + .4f) - .9f + .0042f * t * t * (t > 0);
}

bool isOpen(cv::Vec3f p) {
    const float trail = std::abs(p[0] - trailCentre(p[2]));
    if (p[2] > -62 && p[2] < 40 && trail < 2.6f) return true;
    const cv::Vec2f fromClearing((p[0] - 1) / 18, (p[2] + 22) / 19);
    const float edge = 1 + .35f * fractalNoise(p[0] / 11, p[2] / 11, 3, 40);
    if (fromClearing.dot(fromClearing) < edge * edge) return true;
    return std::hypot(p[0], p[2]) < 11;  // where the camera starts
}

void addTree(Mesh& trunks, Mesh& leaves, cv::Vec3f foot, bool tall, Random& random) {
    const float height = tall ? random.between(11, 19) : random.between(4.5f, 8.5f);
    const float spread = height * (tall ? random.between(.13f, .17f) : random.between(.19f, .25f));
    const float stem = height * (tall ? random.between(.08f, .18f) : .06f);
    const float warm = random.unit(), near = float(cv::norm(foot - cv::Vec3f(0, 0, -15)));
    const cv::Vec3f green =
        cv::Vec3f(.045f + .05f * warm, .088f + .03f * warm, .030f) * random.between(.75f, 1.25f);
    addConifer(trunks, leaves, {foot, height, spread, stem, green, near < 60 ? 26 : 14}, random);
}

void addTrees(Scene& scene, Random& random) {
    Mesh trunks, leaves;
    std::vector<cv::Vec3f> feet;
    int tall = tallTrees, small = shortTrees;
    while (tall + small > 0) {
        const float angle = random.between(0, 6.2832f), reach = 3 + 250 * std::pow(random.unit(), .62f);
        const cv::Vec3f foot(reach * std::cos(angle), 0, -14 + reach * std::sin(angle));
        if (isOpen(foot)) continue;
        const bool crowded = std::any_of(feet.begin(), feet.end(),
                                         [&](cv::Vec3f other) { return cv::norm(other - foot) < 2.3; });
        if (crowded) continue;
        const bool isTall = random.unit() * (tall + small) < tall;
        (isTall ? tall : small)--;
        feet.push_back(foot);
        addTree(trunks, leaves, foot, isTall, random);
    }
    scene.batches.push_back({Material::Bark, std::move(trunks)});
    scene.batches.push_back({Material::Foliage, std::move(leaves)});
}

void addMountain(Mesh& mesh, cv::Vec3f foot, float radius, float height, uint32_t seed) {
    std::vector<float> across;
    for (int k = 0; k <= 150; k++) across.push_back(radius * (k / 75.f - 1));
    Mesh shape;
    addHeightField(shape, across, across,
                   [&](float x, float z) {
                       const float away = std::hypot(x, z) / radius;
                       const float cone = std::pow(std::max(0.f, 1 - away), 1.25f);
                       const float relief = erodedNoise(x / radius * 2.4f, z / radius * 2.4f, 8, seed);
                       const float ridges =
                           1 - std::abs(gradientNoise(x / radius * 1.6f, z / radius * 1.6f, seed + 20).value);
                       return height * (cone * (.55f + .5f * ridges) +
                                        .45f * relief * std::min(1.f, 2.5f * (1 - away))) -
                              8;
                   },
                   {0, 0, 0});
    const uint32_t first = uint32_t(mesh.vertices.size());
    for (Vertex& vertex : shape.vertices) {
        vertex.position += foot;
        mesh.vertices.push_back(vertex);
    }
    for (uint32_t index : shape.indices) mesh.indices.push_back(first + index);
}

// Twelve boxes: walls with a door's opening, its frame and leaf, two windows, roof, sill, chimney.
void addShed(Scene& scene, cv::Vec3f place, float yaw) {
    Mesh planks, roof;
    const auto put = [&](Mesh& mesh, cv::Vec3f at, cv::Vec3f size, cv::Vec3f albedo) {
        addBox(mesh, place + turned(at, yaw), size, yaw, albedo);
    };
    const cv::Vec3f wall(.27f, .165f, .105f), trim(.52f, .48f, .42f), dark(.06f, .05f, .045f);
    put(planks, {-1.45f, 0, 1.5f}, {1.7f, 2.5f, .12f}, wall);
    put(planks, {1.45f, 0, 1.5f}, {1.7f, 2.5f, .12f}, wall);
    put(planks, {0, 2.1f, 1.5f}, {1.2f, .4f, .12f}, wall);
    put(planks, {0, 0, -1.5f}, {4.6f, 2.5f, .12f}, wall);
    put(planks, {-2.25f, 0, 0}, {.12f, 2.5f, 3.f}, wall);
    put(planks, {2.25f, 0, 0}, {.12f, 2.5f, 3.f}, wall);
    put(planks, {0, 0, 1.44f}, {1.1f, 2.08f, .06f}, {.115f, .13f, .10f});
    put(planks, {0, 2.08f, 1.58f}, {1.5f, .12f, .1f}, trim);
    put(roof, {1.5f, .95f, 1.57f}, {.8f, .8f, .05f}, dark);
    put(planks, {1.5f, .82f, 1.62f}, {1.0f, .12f, .14f}, trim);
    put(roof, {1.2f, 2.5f, -.6f}, {.45f, 1.9f, .45f}, {.20f, .13f, .11f});
    put(planks, {0, -.05f, 1.95f}, {2.2f, .18f, .8f}, {.24f, .21f, .17f});
    // The roof: two slopes over gables.
    const auto corner = [&](float x, float y, float z) { return place + turned({x, y, z}, yaw); };
    const cv::Vec3f shingle(.105f, .095f, .095f);
    const float eave = 2.38f, ridge = 3.75f, out = 2.65f, front = 1.95f;
    addQuad(planks, corner(out, eave, front), corner(out, eave, -front), corner(0, ridge, -front),
            corner(0, ridge, front), shingle);
    addQuad(planks, corner(-out, eave, -front), corner(-out, eave, front), corner(0, ridge, front),
            corner(0, ridge, -front), shingle);
    for (float side : {1.f, -1.f}) {
        const uint32_t first = uint32_t(planks.vertices.size());
        const cv::Vec3f normal = turned({0, 0, side}, yaw);
        planks.vertices.push_back({corner(-2.3f, 2.5f, 1.5f * side), normal, wall, 1, {-2.3f, 2.5f}});
        planks.vertices.push_back({corner(2.3f, 2.5f, 1.5f * side), normal, wall, 1, {2.3f, 2.5f}});
        planks.vertices.push_back({corner(0, ridge - .1f, 1.5f * side), normal, wall, 1, {0, ridge - .1f}});
        planks.indices.insert(planks.indices.end(), {first, first + 1, first + 2});
    }
    scene.batches.push_back({Material::Plank, std::move(planks)});
    scene.batches.push_back({Material::Metal, std::move(roof)});
}

void addLampPost(Scene& scene, cv::Vec3f foot) {
    Mesh post, bulb;
    const cv::Vec3f iron(.045f, .048f, .052f);
    addCylinder(post, {foot, foot + cv::Vec3f(0, .5f, 0), .13f, .08f, 16}, iron);
    addCylinder(post, {foot + cv::Vec3f(0, .5f, 0), foot + cv::Vec3f(0, 3.5f, 0), .055f, .045f, 16}, iron);
    addCylinder(post, {foot + cv::Vec3f(0, 3.86f, 0), foot + cv::Vec3f(0, 4.02f, 0), .22f, .04f, 16}, iron);
    addSphere(bulb, foot + cv::Vec3f(0, 3.68f, 0), .19f, 24, {5.f, 3.9f, 2.2f});
    scene.batches.push_back({Material::Metal, std::move(post)});
    scene.batches.push_back({Material::Glow, std::move(bulb), false});
    scene.lights.push_back({foot + cv::Vec3f(0, 3.68f, 0), {1.6f, 1.15f, .6f}, {1, 0, .35f}, 14});
}

void addGrass(Scene& scene, Random& random) {
    Mesh grass;
    for (int tuft = 0; tuft < 34000; tuft++) {
        const float reach = 1.6f + 44 * std::pow(random.unit(), 1.15f), angle = random.between(-1.9f, 1.9f);
        const cv::Vec3f foot(reach * std::sin(angle), 0, 2 - reach * std::cos(angle));
        if (std::abs(foot[0] - trailCentre(foot[2])) < random.between(.6f, 1.3f)) continue;
        const float meadow = fractalNoise(foot[0] / 3, foot[2] / 3, 3, 77);
        if (meadow < random.between(-.6f, .3f)) continue;
        addTuft(grass, foot, .16f + .18f * random.unit() + .12f * std::max(0.f, meadow), random);
    }
    scene.batches.push_back({Material::Foliage, std::move(grass)});
}

}  // namespace

Scene forestDay() {
    Scene scene;
    scene.name = "forest_day";
    Random random(2018);

    Mesh ground;
    std::vector<float> lines;
    for (int k = -60; k <= 60; k++)
        lines.push_back(std::copysign(std::pow(std::abs(k) / 60.f, 2.2f) * 4000, float(k)));
    addHeightField(ground, lines, lines, [](float, float) { return 0.f; }, {0, 0, 0});
    for (Vertex& vertex : ground.vertices) {
        const float wood = std::hypot(vertex.position[0] - 5, vertex.position[2] + 24);
        vertex.occlusion = wood < 20 ? 1.f : wood < 260 ? .7f : 1.f;
    }
    scene.batches.push_back({Material::ForestFloor, std::move(ground), false});

    addTrees(scene, random);
    Mesh mountains;
    addMountain(mountains, {-520, 0, -1500}, 820, 470, 3);
    addMountain(mountains, {260, 0, -1900}, 1050, 690, 11);
    addMountain(mountains, {1150, 0, -1650}, 900, 520, 23);
    addMountain(mountains, {-1500, 0, -2000}, 1100, 610, 31);
    scene.batches.push_back({Material::Terrain, std::move(mountains), false});
    addShed(scene, {-7.2f, 0, -20}, .92f);
    addLampPost(scene, {4.3f, 0, -15.5f});
    addGrass(scene, random);

    scene.sky = {{.10f, .22f, .52f}, {.52f, .66f, .85f}, {.16f, .17f, .13f}, {.55f, .42f, .25f}, .42f, false};
    scene.sunDirection = cv::normalize(cv::Vec3f(.78f, .50f, -.46f));
    scene.sunColor = {2.35f, 2.08f, 1.62f};
    scene.ambientUp = {.30f, .38f, .52f};
    scene.ambientDown = {.10f, .10f, .065f};
    scene.path = [](double s) {
        const float z = float(-15 * s);
        const cv::Vec3f eye(trailCentre(z) * float(s), 1.7f, z + 2);
        return View{eye, {float(1.4 + 2 * s), float(3.1 - .6 * s), -24}};
    };
    scene.horizontalView = 64;
    scene.shadowMin = {-150, -1, -190};
    scene.shadowMax = {150, 20, 60};
    return scene;
}

}  // namespace scenes
