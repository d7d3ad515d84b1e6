// A wet street at night: houses with lit windows, two rows of lamps, parked cars, a shop's sign, the moon.
#include <algorithm>
#include <cmath>

#include "noise.hpp"
#include "scene.hpp"

namespace scenes {
namespace {

constexpr float roadHalf = 4.6f;    // m from the middle to the kerb
constexpr float facadeLine = 7.9f;  // m from the middle to the houses
constexpr float streetEnd = -210;   // z
constexpr float kerb = .13f;

struct House {
    float width, height, depth;
};

void addHouses(Scene& scene, Random& random) {
    Mesh facades, roofs;
    for (float side : {-1.f, 1.f}) {
        float z = 14;
        while (z > streetEnd) {
            const House house{random.between(8, 15), 3.2f * std::floor(random.between(2.6f, 6.4f)) + .5f, 12};
            const float set = random.between(0, .7f), x = side * (facadeLine + set);
            const cv::Vec3f tint =
                cv::Vec3f(.26f, .20f, .165f) * random.between(.6f, 1.25f) +
                cv::Vec3f(random.between(0, .05f), random.between(0, .03f), random.between(0, .05f));
            const float z2 = z - house.width, back = side * (facadeLine + house.depth);
            const cv::Vec3f a(x, 0, z), b(x, 0, z2), up(0, house.height, 0);
            const uint32_t first = uint32_t(facades.vertices.size());
            if (side < 0) {
                addQuad(facades, a, b, b + up, a + up, tint, .7f);
                addQuad(facades, {back, 0, z}, a, a + up, cv::Vec3f(back, house.height, z), tint, .5f);
                addQuad(facades, b, {back, 0, z2}, cv::Vec3f(back, house.height, z2), b + up, tint, .5f);
            } else {
                addQuad(facades, b, a, a + up, b + up, tint, .7f);
                addQuad(facades, a, {back, 0, z}, cv::Vec3f(back, house.height, z), a + up, tint, .5f);
                addQuad(facades, {back, 0, z2}, b, b + up, cv::Vec3f(back, house.height, z2), tint, .5f);
            }
            // Whole bays: the shader's windows are 2.3 m apart in uv.
            for (uint32_t v = first; v < facades.vertices.size(); v++) {
                const float wide = v < first + 4 ? house.width : std::abs(back - x);
                facades.vertices[v].uv[0] *= std::round(wide / 2.3f) * 2.3f / wide;
            }
            const float middle = side * (facadeLine + house.depth / 2);
            addBox(roofs, {middle - side * .3f, house.height - .1f, (z + z2) / 2},
                   {house.depth + .8f, .45f, house.width}, 0, {.06f, .06f, .065f});
            addBox(roofs, {middle, house.height + .3f, z - house.width * random.between(.2f, .8f)},
                   {.8f, random.between(1, 2.2f), .8f}, 0, {.10f, .07f, .06f});
            z = z2;
        }
    }
    // The street ends in a crossing with a taller house behind it.
    addQuad(facades, {-30, 0, streetEnd - 18}, {30, 0, streetEnd - 18}, {30, 29, streetEnd - 18},
            {-30, 29, streetEnd - 18}, {.2f, .17f, .15f}, .6f);
    scene.batches.push_back({Material::Facade, std::move(facades)});
    scene.batches.push_back({Material::Metal, std::move(roofs)});
}

void addGround(Scene& scene) {
    Mesh road, paving;
    std::vector<float> along;
    for (float z = 30; z >= streetEnd - 18; z -= 4) along.push_back(z);
    for (size_t k = 0; k + 1 < along.size(); k++) {
        const float z = along[k], z2 = along[k + 1];
        addQuad(road, {-roadHalf, 0, z}, {roadHalf, 0, z}, {roadHalf, 0, z2}, {-roadHalf, 0, z2},
                {.03f, .03f, .03f});
        for (float side : {-1.f, 1.f}) {
            const float inner = side * roadHalf, outer = side * 9.5f;
            const cv::Vec3f stone(.105f, .10f, .097f);
            const uint32_t first = uint32_t(paving.vertices.size());
            addQuad(paving, {std::min(inner, outer), kerb, z}, {std::max(inner, outer), kerb, z},
                    {std::max(inner, outer), kerb, z2}, {std::min(inner, outer), kerb, z2}, stone, .8f);
            for (uint32_t v = first; v < paving.vertices.size(); v++)
                paving.vertices[v].uv = {paving.vertices[v].position[2], paving.vertices[v].position[0]};
            if (side < 0)
                addQuad(paving, {inner, 0, z}, {inner, 0, z2}, {inner, kerb, z2}, {inner, kerb, z},
                        stone * 1.2f, .6f);
            else
                addQuad(paving, {inner, 0, z2}, {inner, 0, z}, {inner, kerb, z}, {inner, kerb, z2},
                        stone * 1.2f, .6f);
        }
    }
    scene.batches.push_back({Material::Asphalt, std::move(road), false});
    scene.batches.push_back({Material::Paving, std::move(paving), false});
}

void addLamps(Scene& scene) {
    Mesh iron, heads;
    int index = 0;
    for (float z = -7; z > streetEnd; z -= 19, index++) {
        for (float side : {-1.f, 1.f}) {
            const float zs = z + (side > 0 ? 0 : -9.5f);
            const cv::Vec3f foot(side * 5.25f, kerb, zs), top = foot + cv::Vec3f(0, 5.6f, 0);
            const cv::Vec3f head = top + cv::Vec3f(-side * 1.35f, .22f, 0);
            const cv::Vec3f paint(.035f, .045f, .042f);
            addCylinder(iron, {foot, foot + cv::Vec3f(0, .7f, 0), .12f, .10f, 16}, paint);
            addCylinder(iron, {foot + cv::Vec3f(0, .7f, 0), top, .06f, .045f, 16}, paint);
            addCylinder(iron, {top - cv::Vec3f(0, .1f, 0), head + cv::Vec3f(0, .06f, 0), .035f, .03f, 12},
                        paint);
            addCylinder(iron, {head, head + cv::Vec3f(0, .14f, 0), .30f, .10f, 20}, paint);
            const cv::Vec3f glow = index % 3 == 2 ? cv::Vec3f(40, 33, 23) : cv::Vec3f(44, 26, 10);
            addSphere(heads, head - cv::Vec3f(0, .06f, 0), .15f, 20, glow);
            if (scene.lights.size() < 22)
                scene.lights.push_back({head - cv::Vec3f(0, .25f, 0), glow * .145f, {1, 0, .20f}, 24});
        }
    }
    scene.batches.push_back({Material::Metal, std::move(iron)});
    scene.batches.push_back({Material::Glow, std::move(heads), false});
}

void addCar(Mesh& body, Mesh& glass, Mesh& lamps, cv::Vec3f place, bool towardsUs, bool lit,
            cv::Vec3f paint) {
    const float front = towardsUs ? 1.f : -1.f;
    const auto at = [&](float x, float y, float z) { return place + cv::Vec3f(x, y, z * front); };
    // The profile from nose to tail: (z, height), drawn out over the car's width.
    const cv::Vec2f lower[] = {{2.15f, .35f},  {2.2f, .62f},  {1.95f, .78f}, {1.0f, .92f},
                               {-1.55f, .98f}, {-2.1f, .92f}, {-2.18f, .45f}};
    const cv::Vec2f cabin[] = {{1.0f, .92f}, {.25f, 1.42f}, {-.95f, 1.46f}, {-1.75f, .97f}};
    const auto strip = [&](Mesh& mesh, const auto& profile, float half, float upperHalf, float base,
                           cv::Vec3f albedo) {
        const size_t n = std::size(profile);
        for (size_t k = 0; k + 1 < n; k++) {
            const float z0 = profile[k][0], z1 = profile[k + 1][0], y0 = profile[k][1],
                        y1 = profile[k + 1][1];
            const float h0 = y0 > base + .2f ? upperHalf : half, h1 = y1 > base + .2f ? upperHalf : half;
            addQuad(mesh, at(-h0, y0, z0), at(h0, y0, z0), at(h1, y1, z1), at(-h1, y1, z1), albedo);
            for (float side : {-1.f, 1.f})
                addQuad(mesh, at(side * half, base, z0), at(side * half, base, z1), at(side * h1, y1, z1),
                        at(side * h0, y0, z0), albedo);
        }
    };
    strip(body, lower, .90f, .87f, .22f, paint);
    strip(glass, cabin, .80f, .62f, .90f, {.035f, .038f, .045f});
    addBox(glass, place + cv::Vec3f(0, .13f, 0), {1.5f, .2f, 4.1f}, 0, {.012f, .012f, .012f});
    for (float z : {-2.17f, 2.19f})
        addBox(glass, at(0, .30f, z), {1.72f, .16f, .07f}, 0, {.02f, .02f, .022f});
    for (float x : {-.79f, .79f})
        for (float z : {-1.35f, 1.35f})
            addCylinder(glass, {at(x - .1f, .32f, z), at(x + .1f, .32f, z), .32f, .32f, 20},
                        {.015f, .015f, .015f});
    for (float x : {-.66f, .66f}) {
        const cv::Vec3f red = lit ? cv::Vec3f(7.5f, .42f, .22f) : cv::Vec3f(.10f, .01f, .01f);
        const cv::Vec3f white = lit ? cv::Vec3f(30, 28, 24) : cv::Vec3f(.15f, .15f, .15f);
        addBox(lamps, at(x, .70f, -2.17f), {.34f, .13f, .05f}, 0, red);
        addBox(lamps, at(x, .58f, 2.19f), {.32f, .13f, .05f}, 0, white);
    }
}

void addCars(Scene& scene) {
    Mesh body, glass, lamps;
    addCar(body, glass, lamps, {3.55f, 0, -13.5f}, false, false, {.055f, .07f, .12f});
    addCar(body, glass, lamps, {3.6f, 0, -26.5f}, false, false, {.16f, .03f, .025f});
    addCar(body, glass, lamps, {-3.6f, 0, -21}, true, false, {.10f, .105f, .11f});
    addCar(body, glass, lamps, {-3.55f, 0, -47}, true, false, {.03f, .06f, .05f});
    addCar(body, glass, lamps, {1.75f, 0, -34}, false, true, {.02f, .02f, .022f});
    addCar(body, glass, lamps, {-1.8f, 0, -92}, true, true, {.10f, .10f, .10f});
    scene.batches.push_back({Material::Metal, std::move(body)});
    scene.batches.push_back({Material::Metal, std::move(glass)});
    scene.batches.push_back({Material::Glow, std::move(lamps), false});
    scene.lights.push_back({{-1.8f, .65f, -88.5f}, {5.5f, 5.1f, 4.4f}, {1, 0, .12f}, 22});
    scene.lights.push_back({{1.75f, .7f, -31.2f}, {1.1f, .07f, .04f}, {1, 0, .5f}, 8});
}

void addSigns(Scene& scene) {
    Mesh frames, glow;
    const struct {
        float side, z, y, width, height;
        cv::Vec3f color;
    } signs[] = {{1, -18, 3.6f, .9f, 2.3f, {.25f, 3.1f, 2.5f}},
                 {-1, -31, 3.5f, .8f, 1.9f, {3.8f, .45f, 1.5f}},
                 {1, -57, 4.0f, .9f, 2.8f, {3.6f, 1.5f, .25f}}};
    for (const auto& sign : signs) {
        const cv::Vec3f base(sign.side * (facadeLine - .75f), sign.y, sign.z);
        addBox(frames, base, {sign.width + .12f, sign.height + .12f, .16f}, 0, {.03f, .03f, .03f});
        const int bars = 4;
        for (int k = 0; k < bars; k++) {  // strokes of light, like characters one above another
            const float y = .16f + (sign.height - .2f) * k / bars, wide = sign.width * (k % 2 ? .45f : .72f);
            addBox(glow, base + cv::Vec3f(0, y, .085f), {wide, .09f, .03f}, 0, sign.color);
            addBox(glow, base + cv::Vec3f(k % 2 ? -.16f : .14f, y, .085f),
                   {.08f, sign.height / bars * .78f, .03f}, 0, sign.color);
        }
        scene.lights.push_back(
            {base + cv::Vec3f(-sign.side * .2f, sign.height / 2, .5f), sign.color * .22f, {1, 0, .4f}, 9});
    }
    scene.batches.push_back({Material::Metal, std::move(frames)});
    scene.batches.push_back({Material::Glow, std::move(glow), false});
}

}  // namespace

Scene streetNight() {
    Scene scene;
    scene.name = "street_night";
    Random random(77);
    addCars(scene);
    addSigns(scene);
    addHouses(scene, random);
    addGround(scene);
    addLamps(scene);

    scene.sky = {{.0035f, .0055f, .013f},
                 {.016f, .018f, .026f},
                 {.004f, .004f, .005f},
                 {.030f, .019f, .010f},
                 0,
                 true};
    scene.sunDirection = cv::normalize(cv::Vec3f(.16f, .40f, -.80f));  // the moon
    scene.sunColor = {.022f, .026f, .036f};
    scene.ambientUp = {.030f, .031f, .040f};
    scene.ambientDown = {.022f, .016f, .011f};
    scene.mirrorHeight = 0;
    scene.path = [](double s) {
        const float z = float(-26 * s);
        return View{{float(-1.1 + .5 * s), 1.65f, z + 3}, {.35f, 2.15f, z - 22}};
    };
    scene.horizontalView = 66;
    scene.farPlane = 2000;
    scene.shadowMin = {-22, -.5f, streetEnd - 20};
    scene.shadowMax = {22, 30, 32};
    return scene;
}

}  // namespace scenes
