// Trees and grass, shared by the scenes that have them.
#pragma once

#include "mesh.hpp"
#include "noise.hpp"

namespace scenes {

/// A conifer: a trunk and five layers of branches, six cylinders in all.
struct Conifer {
    cv::Vec3f foot;
    float height, spread;  ///< m: to the tip, and the radius of the lowest layer
    float stem;            ///< m of bare trunk below the branches
    cv::Vec3f green;
    int sides = 18;
};
void addConifer(Mesh& trunks, Mesh& leaves, const Conifer& tree, Random& random);

/// Six blades from one place.
void addTuft(Mesh& grass, cv::Vec3f foot, float height, Random& random);

}  // namespace scenes
