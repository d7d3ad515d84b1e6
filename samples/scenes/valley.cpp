// A mountain valley with a lake, late in the day: relief from ten metres to nine hundred, seen from a
// shoulder above the water.
#include <algorithm>
#include <cmath>

#include "plants.hpp"
#include "scene.hpp"

namespace scenes {
namespace {

constexpr float stand[2] = {-205, 40};  // x and z where the camera's way begins

// The valley's floor winds along this line; the lake lies on it.
float axis(float z) { return 170 * std::sin(z / 900.f + .5f) + 60 * std::sin(z / 370.f); }

float smooth(float low, float high, float x) {
    const float t = std::clamp((x - low) / (high - low), 0.f, 1.f);
    return t * t * (3 - 2 * t);
}

float terrainHeight(float x, float z) {
    const float away = std::abs(x - axis(z));
    const float side = 1 - std::exp(-std::pow(away / 620, 2.1f));
    const float broad = fractalNoise(x / 1500, z / 1500, 3, 5);
    const float peaks = erodedNoise(x / 1150 + 4, z / 1150, 10, 17);
    const float ridges = 1 - std::abs(gradientNoise(x / 830, z / 830, 41).value);
    const float rise = 90 + 560 * side + 260 * smooth(-1500, -4200, z) * side;
    const float spurs = 1 - std::abs(gradientNoise(x / 310 + .7f * broad, z / 310, 43).value);
    float height = rise * (.30f + .42f * ridges * side + .72f * peaks + .3f * broad + .16f * spurs * spurs) *
                   (.10f + .90f * side);
    height += 14 * fractalNoise(x / 160, z / 160, 5, 61) * (.25f + side);
    // The lake's bed, which closes about two kilometres away.
    const float lake =
        smooth(330, 90, away + 60 * fractalNoise(x / 200, z / 200, 3, 71)) * smooth(-2700, -1900, z);
    height = height * (1 - .82f * lake) - 26 * lake;
    // The shoulder that the camera stands on.
    const float dx = (x - stand[0] + 20) / 190, dz = (z - stand[1] - 20) / 170;
    height += 24 * std::exp(-dx * dx - dz * dz);
    return height;
}

// Lines close together near the camera's way, wide apart far off.
std::vector<float> gridLines(float low, float high, float focus, float finest, float growth) {
    std::vector<float> below, above;
    for (float x = focus, step = finest; x > low; x -= step, step *= growth) below.push_back(x);
    for (float x = focus + finest, step = finest; x < high; x += step, step *= growth) above.push_back(x);
    below.push_back(low);
    std::reverse(below.begin(), below.end());
    below.insert(below.end(), above.begin(), above.end());
    below.push_back(high);
    return below;
}

void addPlants(Scene& scene, Random& random) {
    Mesh trunks, leaves, grass;
    for (int tried = 0; tried < 60000; tried++) {
        const float x = stand[0] + random.between(-1, 1) * 900, z = 160 - 1500 * std::pow(random.unit(), .8f);
        const float height = terrainHeight(x, z), away = std::hypot(x - stand[0], z - stand[1]);
        const float slope =
            std::hypot(terrainHeight(x + 4, z) - height, terrainHeight(x, z + 4) - height) / 4;
        const float grove = fractalNoise(x / 130, z / 130, 4, 90);
        if (height < 5 || height > 330 || slope > .75f || grove < random.between(.02f, .22f)) continue;
        // Near the camera's way only to its left, where they frame the lake.
        const float ahead = stand[1] - z, left = stand[0] - x;
        if (away < 45 || (away < 260 && ahead > -20 && left < .30f * ahead + 4)) continue;
        const float tall = random.between(6, 15);
        const cv::Vec3f green =
            cv::Vec3f(.038f + .03f * random.unit(), .070f, .024f) * random.between(.75f, 1.25f);
        addConifer(trunks, leaves,
                   {{x, height - .3f, z},
                    tall,
                    tall * random.between(.14f, .19f),
                    tall * .08f,
                    green,
                    away < 250 ? 18 : 7},
                   random);
    }
    // A few near the beginning of the camera's way, for fog to set one behind another.
    const cv::Vec3f near[] = {{-10.5f, 25, 9}, {-15.5f, 31, 12}, {-13, 39, 8},   {-22, 44, 14},
                              {-9, 58, 11},    {-19, 62, 13},    {-13, 78, 12},  {11, 44, 7},
                              {15, 52, 10},    {-5, 96, 12},     {-12, 104, 14}, {24, 86, 9},
                              {2, 118, 11},    {-24, 126, 13},   {17, 112, 12},  {31, 71, 11}};
    for (const cv::Vec3f& place : near) {
        const float x = stand[0] + place[0], z = stand[1] - place[1];
        const cv::Vec3f foot(x, terrainHeight(x, z) - .3f, z);
        if (foot[1] > 1)
            addConifer(trunks, leaves,
                       {foot, place[2], place[2] * .16f, place[2] * .07f, {.05f, .08f, .028f}, 26}, random);
    }
    for (int tuft = 0; tuft < 30000; tuft++) {
        const float reach = 1.5f + 50 * std::pow(random.unit(), 1.2f), angle = random.between(-1.6f, 1.6f);
        const float x = stand[0] + reach * std::sin(angle), z = stand[1] + 1 - reach * std::cos(angle);
        if (fractalNoise(x / 4, z / 4, 3, 77) < random.between(-.5f, .3f)) continue;
        addTuft(grass, {x, terrainHeight(x, z) - .03f, z}, random.between(.15f, .4f), random);
    }
    scene.batches.push_back({Material::Bark, std::move(trunks)});
    scene.batches.push_back({Material::Foliage, std::move(leaves)});
    scene.batches.push_back({Material::Foliage, std::move(grass)});
}

}  // namespace

Scene valley() {
    Scene scene;
    scene.name = "valley";
    Random random(5);
    Mesh terrain, water;
    const std::vector<float> xs = gridLines(-5200, 5200, stand[0], .9f, 1.0135f);
    const std::vector<float> zs = gridLines(-9000, 500, stand[1], .9f, 1.011f);
    addHeightField(terrain, xs, zs, terrainHeight, {0, 0, 0});
    for (Vertex& vertex : terrain.vertices) vertex.occlusion = .72f + .28f * vertex.normal[1];
    scene.batches.push_back({Material::Terrain, std::move(terrain)});
    std::vector<float> across, along;
    for (int k = 0; k <= 24; k++) across.push_back(-1100 + 2200 * k / 24.f);
    for (int k = 0; k <= 60; k++) along.push_back(-3000 + 3500 * k / 60.f);
    addHeightField(water, across, along, [](float, float) { return 0.f; }, {0, 0, 0});
    scene.batches.push_back({Material::Water, std::move(water), false});
    addPlants(scene, random);

    scene.sky = {
        {.085f, .19f, .47f}, {.60f, .66f, .74f}, {.14f, .15f, .14f}, {.95f, .60f, .28f}, .46f, false};
    scene.sunDirection = cv::normalize(cv::Vec3f(.80f, .36f, -.52f));
    scene.sunColor = {2.55f, 1.95f, 1.30f};
    scene.ambientUp = {.25f, .33f, .48f};
    scene.ambientDown = {.11f, .10f, .08f};
    scene.mirrorHeight = 0;
    scene.path = [](double s) {
        const float x = float(stand[0] + 40 * s), z = float(stand[1] - 120 * s);
        const float y = std::max(terrainHeight(x, z), 2.f) + 2.2f + float(12 * s);
        return View{{x, y, z}, {float(60 - 40 * s), float(30 + .3 * y), -1100}};
    };
    scene.horizontalView = 62;
    scene.nearPlane = .5;
    scene.farPlane = 30000;
    scene.shadowMin = {-2600, -30, -4200};
    scene.shadowMax = {2600, 900, 500};
    return scene;
}

}  // namespace scenes
