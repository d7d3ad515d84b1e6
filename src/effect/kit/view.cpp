#include "effect/kit/view.hpp"

namespace brume {

View View::of(const Camera& camera, int width, int height, int frameWidth, int frameHeight) {
    View view;
    view.width = width, view.height = height;
    view.frameWidth = frameWidth, view.frameHeight = frameHeight;
    view.camera = camera.resized({frameWidth, frameHeight}, {width, height});
    const Camera& c = view.camera;
    view.inverseFx = float(1 / c.fx), view.inverseFy = float(1 / c.fy);
    view.originX = float(.5 - c.cx), view.originY = float(.5 - c.cy);
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 3; column++)
            view.worldFromView(row, column) = float(c.worldFromCamera(row, column));
    view.eye = cv::Vec3f(c.eye());
    return view;
}

}  // namespace brume
