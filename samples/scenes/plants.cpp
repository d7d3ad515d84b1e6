#include "plants.hpp"

#include <algorithm>
#include <cmath>

namespace scenes {

void addConifer(Mesh& trunks, Mesh& leaves, const Conifer& tree, Random& random) {
    const float height = tree.height;
    const cv::Vec3f lean(random.between(-.02f, .02f) * height, height, random.between(-.02f, .02f) * height);
    const auto at = [&](float share) { return tree.foot + lean * share; };
    const cv::Vec3f bark = cv::Vec3f(.135f, .10f, .072f) * random.between(.7f, 1.2f);
    addCylinder(trunks,
                {at(-.02f), at(.93f), .012f * height + .06f, .02f, std::max(5, tree.sides / 2), .55f, .3f},
                bark);
    const float bottom = tree.stem / height;
    for (int layer = 0; layer < 5; layer++) {
        const float low = bottom + (1 - bottom) * (layer / 5.4f),
                    high = std::min(1.f, low + (1 - bottom) * .36f);
        const float radius = tree.spread * (1 - .84f * layer / 5) * random.between(.9f, 1.12f);
        Cylinder shape{at(low),           at(high), radius, radius * .10f, tree.sides, .62f + .07f * layer,
                       .45f + .1f * layer};
        shape.scallop = random.between(.22f, .36f);
        shape.turn = random.between(0, 6.283f);
        addCylinder(leaves, shape, tree.green * (.85f + .07f * layer));
    }
}

void addTuft(Mesh& grass, cv::Vec3f foot, float height, Random& random) {
    const float dry = random.unit();
    const cv::Vec3f tint =
        cv::Vec3f(.085f + .10f * dry, .13f + .06f * dry, .035f + .02f * dry) * random.between(.7f, 1.2f);
    for (int blade = 0; blade < 6; blade++) {
        const float turn = random.between(0, 6.2832f), tall = height * random.between(.35f, 1);
        const cv::Vec3f out(std::cos(turn), 0, std::sin(turn)), across(-out[2], 0, out[0]);
        const cv::Vec3f root = foot + out * random.between(0, .4f * height);
        const cv::Vec3f tip = root + out * (tall * .55f) + cv::Vec3f(0, tall, 0);
        const cv::Vec3f normal = cv::normalize(cv::Vec3f(out[0] * .5f, 1, out[2] * .5f));
        const uint32_t first = uint32_t(grass.vertices.size());
        grass.vertices.push_back({root - across * .012f, normal, tint, .45f, {}});
        grass.vertices.push_back({root + across * .012f, normal, tint, .45f, {}});
        grass.vertices.push_back({tip, normal, tint * 1.25f, 1, {}});
        grass.indices.insert(grass.indices.end(), {first, first + 1, first + 2});
    }
}

}  // namespace scenes
