#include "measure/check_pixels.hpp"

#include <cmath>
#include <set>

namespace brume {

std::vector<cv::Point> spreadPixels(cv::Size size, size_t count) {
    std::vector<cv::Point> pixels;
    if (size.area() <= int(count)) {
        for (int k = 0; k < size.area(); k++) pixels.emplace_back(k % size.width, k / size.width);
        return pixels;
    }
    std::set<std::pair<int, int>> seen;
    auto add = [&](int x, int y) {
        if (pixels.size() < count && seen.insert({x, y}).second) pixels.emplace_back(x, y);
    };
    int right = size.width - 1, bottom = size.height - 1;
    for (int x : {0, right})
        for (int y : {0, bottom}) add(x, y);
    for (int k = 1; k < 8; k++)
        for (bool far : {false, true}) {
            add(right * k / 8, far ? bottom : 0);
            add(far ? right : 0, bottom * k / 8);
        }
    const double g = 1.32471795724474602596;  // plastic number
    for (int k = 1; pixels.size() < count; k++)
        add(int(std::fmod(.5 + k / g, 1.) * size.width), int(std::fmod(.5 + k / (g * g), 1.) * size.height));
    return pixels;
}

}  // namespace brume
