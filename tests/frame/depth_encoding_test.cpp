#include "frame/depth_encoding.hpp"

#include "frame_fixture.hpp"

namespace brume {
namespace {

using Kind = DepthEncoding::Kind;
using test::sentenceOf;
constexpr double inf = DepthEncoding::infinity;

float decodeOne(double stored, const DepthEncoding& e) {
    const Camera camera = Camera::withHorizontalView({1, 1}, 60);
    return decodeDepth(cv::Mat(1, 1, CV_32F, cv::Scalar(stored)), e, camera).at<float>(0, 0);
}

/// Each encoding in use, for the tests that hold for all.
std::vector<DepthEncoding> everyEncoding() {
    std::vector<DepthEncoding> all;
    for (const char* text :
         {"linear", "linear:scale_to_metres=.01,zero_is_sky=true", "tum", "kitti", "realsense", "blender",
          "disparity:focal_baseline=120,offset=2.5", "middlebury:focal_baseline=700,offset=31,scale=.5",
          "inverse", "inverse:scale=.25,offset=.001", "opengl:near=.1,far=100",
          "opengl:near=4,far=2740,metres_per_unit=.0254", "direct3d:near=.1,far=100,reversed=true",
          "vulkan:near=.1,far=infinite", "vulkan:near=.1,far=infinite,reversed=true",
          "opengl:near=.1,far=100,range=-1,range=1", "reshade:near=.1,far=500",
          "reshade:near=1,far=1000,reversed=true"})
        all.push_back(parseDepthEncoding(text));
    return all;
}

TEST(DepthEncoding, ThereAndBackInFp64) {
    for (const DepthEncoding& e : everyEncoding()) {
        for (double z : {.5, 1., 7.25, 60., 99.}) {
            if (z < e.nearPlane * e.metresPerUnit) continue;
            const double stored = encodeDepth(z, e);
            // One step of the stored fp32 number, seen in metres, is all that may be lost.
            const float lower = std::nextafter(float(stored), -INFINITY),
                        upper = std::nextafter(float(stored), INFINITY);
            const double step =
                std::max(std::abs(decodeOne(lower, e) - z), std::abs(decodeOne(upper, e) - z));
            EXPECT_NEAR(decodeOne(stored, e), z, step + z * 1e-7) << e.describe();
        }
        EXPECT_EQ(decodeOne(encodeDepth(inf, e), e), INFINITY) << e.describe();
        EXPECT_TRUE(std::isnan(decodeOne(NAN, e))) << e.describe();
    }
}

TEST(DepthEncoding, DeviceDepthIsWhatAProjectionMatrixGives) {
    // Projects points by OpenGL's and by Direct3D's reversed matrix in long double, then decodes.
    const long double n = .1L, f = 1000;
    const DepthEncoding gl = parseDepthEncoding("opengl:near=.1,far=1000");
    const DepthEncoding reversed = parseDepthEncoding("direct3d:near=.1,far=1000,reversed=true");
    const DepthEncoding endless = parseDepthEncoding("vulkan:near=.1,far=infinite");
    for (const long double z : {.11L, 1.L, 10.L, 100.L, 900.L}) {
        const long double ndc = ((f + n) / (f - n) * z - 2 * f * n / (f - n)) / z;
        const long double flipped = (n * f / (f - n) / z - n / (f - n));
        const auto check = [&](long double stored, const DepthEncoding& e) {
            const double half = double(std::abs((long double)std::nextafter(float(stored), 2.f) - stored));
            // dZ/dδ = Z²(f - n)/(f n): the stored number's own rounding, plus 6e-8 of arithmetic.
            const double allowed = double(z * z / n) * half + double(z) * 6e-8;
            EXPECT_NEAR(decodeOne(double(float(stored)), e), double(z), allowed)
                << double(z) << " " << e.describe();
        };
        check((ndc + 1) / 2, gl);
        check(flipped, reversed);
        check(1 - n / z, endless);
    }
}

TEST(DepthEncoding, ReshadeUndoesItsShader) {
    // ReShade.fxh: depth /= F - depth·(F - 1), near taken as 1.
    const DepthEncoding e = parseDepthEncoding("reshade:near=.1,far=500");
    for (const double z : {.2, 3., 40., 450.}) {
        const double delta = 500 / (500 - .1) * (1 - .1 / z);
        const double shown = delta / (1000 - delta * 999);
        EXPECT_NEAR(decodeOne(shown, e), z, z * z / .1 * 1e-7 + 1e-6);
    }
}

TEST(DepthEncoding, ClassesNeverMeanNear) {
    const DepthEncoding rendered = parseDepthEncoding("blender:zero_is_sky=true");
    EXPECT_EQ(decodeOne(0, rendered), INFINITY);
    for (const double sky : {1e9, 1e10, 1e30, inf}) EXPECT_EQ(decodeOne(sky, rendered), INFINITY) << sky;
    const DepthEncoding sensor = parseDepthEncoding("linear:scale_to_metres=.001,unknown=0,unknown=65525");
    for (const double nothing : {0., 65525., -3., double(NAN)})
        EXPECT_TRUE(std::isnan(decodeOne(nothing, sensor)));
    EXPECT_FLOAT_EQ(decodeOne(1500, sensor), 1.5f);
    EXPECT_TRUE(std::isnan(decodeOne(inf, parseDepthEncoding("middlebury:focal_baseline=100"))));
    EXPECT_EQ(decodeOne(1, parseDepthEncoding("opengl:near=.1,far=100")), INFINITY);
    EXPECT_EQ(decodeOne(0, parseDepthEncoding("opengl:near=.1,far=100,reversed=true")), INFINITY);
    EXPECT_TRUE(std::isnan(decodeOne(-.2, parseDepthEncoding("opengl:near=.1,far=100"))));
    EXPECT_EQ(decodeOne(40, parseDepthEncoding("linear:sky_beyond=30")), INFINITY);
    EXPECT_EQ(decodeOne(30, parseDepthEncoding("linear:sky_beyond=30")), INFINITY) << "from there on";
}

TEST(DepthEncoding, DistanceAlongTheRayBecomesPlanar) {
    Camera camera = Camera::withHorizontalView({64, 48}, 90);
    DepthEncoding e;
    e.alongRay = true;
    const cv::Mat z = decodeDepth(cv::Mat(48, 64, CV_32F, cv::Scalar(10)), e, camera);
    for (const cv::Point p : {cv::Point(0, 0), cv::Point(63, 20), cv::Point(32, 24)}) {
        const cv::Vec3d ray = camera.ray(p.x, p.y);
        EXPECT_NEAR(z.at<float>(p) * cv::norm(ray), 10, 1e-5);
    }
}

TEST(DepthEncoding, IntegersAndFloatsOfTheSameNumbersAgree) {
    const DepthEncoding e = parseDepthEncoding("tum");
    const Camera camera = Camera::withHorizontalView({256, 1}, 60);
    cv::Mat words(1, 256, CV_16U), floats;
    for (int i = 0; i < 256; ++i) words.at<ushort>(0, i) = ushort(i * 257);
    words.convertTo(floats, CV_32F);
    EXPECT_EQ(test::bitsThatDiffer(decodeDepth(words, e, camera), decodeDepth(floats, e, camera)), 0);
}

TEST(DepthEncoding, DepthBuffersInIntegersFillTheirRange) {
    const Camera camera = Camera::withHorizontalView({40, 1}, 60);
    for (const char* name :
         {"opengl:near=.1,far=100", "direct3d:near=.1,far=100,reversed=true", "reshade:near=.1,far=100"})
        for (const int type : {CV_8U, CV_16U}) {
            const DepthEncoding e = parseDepthEncoding(name);
            const double most = type == CV_8U ? 255 : 65535;
            cv::Mat integers(1, 40, type), floats(1, 40, CV_32F);
            for (int i = 0; i < 40; ++i) floats.at<float>(0, i) = float(encodeDepth(.2 + 2.5 * i, e));
            floats.convertTo(integers, type, most);
            integers.convertTo(floats, CV_32F, 1 / most);
            const cv::Mat z = decodeDepth(integers, e, camera), same = decodeDepth(floats, e, camera);
            for (int i = 0; i < 40; ++i) {
                const float a = z.at<float>(0, i), b = same.at<float>(0, i);
                EXPECT_TRUE(std::isinf(a) ? std::isinf(b) || b > 90 : std::abs(a - b) < 1e-3f * a * a)
                    << name << " " << most << ": " << a << " for " << b;
            }
            EXPECT_TRUE(std::isfinite(z.at<float>(0, 0)));
            // What is stated counts: ends of another's choosing, for ReShade's numbers as well.
            DepthEncoding stated = e;
            stated.range = {0, 2 * most};
            integers.convertTo(floats, CV_32F, .5 / most);
            EXPECT_NEAR(decodeDepth(integers, stated, camera).at<float>(0, 0),
                        decodeDepth(floats, e, camera).at<float>(0, 0), 1e-6)
                << name;
        }
}

TEST(DepthEncoding, KeysOfOtherEncodingsAreRefused) {
    const auto usage = [](const char* text) {
        return sentenceOf(ErrorKind::Usage, [&] { parseDepthEncoding(text); });
    };
    EXPECT_NE(usage("tum:scale=2").find("scale says nothing of linear depth (did you mean scale_to_metres?)"),
              std::string::npos)
        << usage("tum:scale=2");
    EXPECT_NE(usage("linear:metres_per_unit=.01").find("did you mean scale_to_metres?"), std::string::npos);
    EXPECT_NE(usage("opengl:near=.1,far=9,scale_to_metres=.01").find("did you mean metres_per_unit?"),
              std::string::npos);
    EXPECT_NE(usage("opengl:near=.1,far=9,sky_at_or_above=1").find("says nothing of a depth buffer"),
              std::string::npos);
    EXPECT_NE(usage("kitti:range=0,range=255").find("range says nothing of linear depth"), std::string::npos);
    EXPECT_NE(usage("inverse:focal_baseline=9").find("did you mean scale?"), std::string::npos);
    EXPECT_NE(usage("disparity:focal_baseline=9,reversed=true").find("says nothing of disparity"),
              std::string::npos);
    // What a renderer says of its projection is no statement about numbers that are metres already.
    EXPECT_NO_THROW(parseDepthEncoding("linear:near=.1,far=infinite"));
}

TEST(DepthEncoding, MistakesAreNamed) {
    const auto usage = [](const char* text) {
        return sentenceOf(ErrorKind::Usage, [&] { parseDepthEncoding(text); });
    };
    EXPECT_NE(usage("opengk:near=1,far=2").find("opengl"), std::string::npos);
    EXPECT_NE(usage("meters").find("did you mean 'metres'"), std::string::npos);
    EXPECT_NE(usage("kinekt").find("did you mean 'kinect'"), std::string::npos);
    EXPECT_NE(usage("opneGL:near=1,far=2").find("did you mean 'opengl'"), std::string::npos);
    EXPECT_NE(usage("pointcloud").find("there are: linear, device"), std::string::npos)
        << usage("pointcloud");
    EXPECT_NE(usage("opengl/direct3d").find("after opengl comes a colon"), std::string::npos);
    EXPECT_NE(usage("opengl:nera=1").find("did you mean 'near'"), std::string::npos);
    EXPECT_NE(usage("opengl:near=1").find("needs far, as in 'opengl:near=.1,far=1000'"), std::string::npos);
    EXPECT_NE(usage("opengl").find("needs near and far"), std::string::npos);
    EXPECT_NE(usage("opengl:near=5,far=2").find("not beyond near"), std::string::npos);
    EXPECT_NE(usage("linear:scale_to_meters=2").find("scale_to_metres"), std::string::npos);
    EXPECT_NE(usage("linear:scale_to_metres=abc").find("not a number"), std::string::npos);
    EXPECT_NE(usage("linear:scale_to_metres=0").find("above 0"), std::string::npos);
    EXPECT_NE(usage("middlebury").find("focal_baseline"), std::string::npos);
    EXPECT_NE(usage("linear:encoding=2").find("encoding is [\"linear\",2.0], not a name"), std::string::npos);
}

}  // namespace
}  // namespace brume
