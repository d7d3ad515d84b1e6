// The parameters of height_fog, as its header declares them.
#pragma once

#include <opencv2/core/matx.hpp>
#include <vector>

namespace brume::height_fog {

enum Profile { exponential, ramp, table };
enum Method { closedForm, tableLinear, tableHermite, march };

struct RampPoint {
    float height = 0, density = 0;
    cv::Vec3f tint;
};
struct TableRow {
    float density = 0;
    cv::Vec3f tint;
};

struct HeightFog {
    int profile = 0, method = 0;
    cv::Vec3f color;
    float density = 0, height = 0, falloff = 0, density2 = 0, height2 = 0, falloff2 = 0;
    cv::Vec3f tint, tint2;
    std::vector<RampPoint> ramp;
    std::vector<TableRow> table;
    float tableBottom = 0, tableTop = 0;
    int tableSize = 2, steps = 1;

    bool usesTable() const {
        return profile == Profile::table || method == tableLinear || method == tableHermite;
    }
};

}  // namespace brume::height_fog
