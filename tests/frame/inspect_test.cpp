// Doubts on captures that are right and on copies made wrong on purpose: the table of docs/INSPECT.md. With
// BRUME_UPDATE_DOCS set the test writes the table anew instead of comparing.
#include "frame/inspect.hpp"

#include <cstdlib>
#include <functional>
#include <opencv2/core.hpp>
#include <set>

#include "frame/write.hpp"
#include "frame_fixture.hpp"

namespace brume {
namespace {

namespace fs = std::filesystem;
using Kind = DepthEncoding::Kind;

struct Copy {
    Capture capture;
    DepthEncoding encoding;
};

const std::vector<std::string>& trueCaptures() {
    static const std::vector<std::string> names = {"openarena/am_galmevish2.png",
                                                   "openarena/czest1dm.png",
                                                   "openarena/islandctf.png",
                                                   "openarena/oa_shine.png",
                                                   "openarena/wrackdm17.png",
                                                   "blender/flat_clear.exr",
                                                   "blender/flat_fog.exr",
                                                   "blender/night_clear.exr",
                                                   "tum/color.png",
                                                   "lingbot/night_skatepark.jpg",
                                                   "habitat/skokloster_color.npy",
                                                   "promptda/library.jpg",
                                                   "openexr/beachball_singlepart.0001.exr"};
    return names;
}

/// Depth stored anew from planar metres; `number` gives what is stored for finite Z.
Copy restored(const Copy& from, const DepthEncoding& encoding, const std::function<float(float)>& number) {
    Copy copy = from;
    const cv::Size size = from.capture.stored.size();
    cv::Mat z = decodeDepth(from.capture.stored, from.encoding,
                            from.capture.frame.camera.resized(from.capture.frame.size(), size));
    for (int j = 0; j < z.rows; ++j)
        for (int i = 0; i < z.cols; ++i) {
            float& v = z.at<float>(j, i);
            if (std::isfinite(v)) v = number(v);
        }
    copy.capture.stored = z;
    copy.encoding = encoding;
    return copy;
}

double farthest(const Copy& copy) {
    return depthStatistics(decodeDepth(copy.capture.stored, copy.encoding, copy.capture.frame.camera)).p99;
}

/// Nothing where the fault makes no sense for the capture.
struct Fault {
    std::string title, doubt;
    std::function<std::optional<Copy>(const Copy&)> make;
};

const std::vector<Fault>& faults() {
    const auto flipped = [](const Copy& from, int code) {
        Copy copy = from;
        copy.capture.stored = cv::Mat();  // not the true one's memory
        cv::flip(from.capture.stored, copy.capture.stored, code);
        return copy;
    };
    const auto deviceOnly = [](const Copy& from,
                               const std::function<void(DepthEncoding&)>& change) -> std::optional<Copy> {
        if (from.encoding.kind != Kind::Device) return std::nullopt;
        Copy copy = from;
        change(copy.encoding);
        return copy;
    };
    static const std::vector<Fault> all = {
        {"polarity reversed", "polarity",
         [](const Copy& from) -> std::optional<Copy> {
             if (from.encoding.kind == Kind::Device) {
                 Copy copy = from;
                 copy.encoding.reversed = !copy.encoding.reversed;
                 return copy;
             }
             const float sum = float(farthest(from)) * 1.05f;
             return restored(from, DepthEncoding(), [sum](float z) { return std::max(sum - z, .01f * sum); });
         }},
        {"disparity taken for depth", "disparity",
         [](const Copy& from) { return restored(from, DepthEncoding(), [](float z) { return 60 / z; }); }},
        {"mirrored", "mirrored", [=](const Copy& from) { return flipped(from, 1); }},
        {"upside down", "flipped", [=](const Copy& from) { return flipped(from, 0); }},
        {"far plane ÷ 10", "far plane",
         [=](const Copy& from) { return deviceOnly(from, [](DepthEncoding& e) { e.farPlane /= 10; }); }},
        {"far plane × 10", "far plane",
         [=](const Copy& from) { return deviceOnly(from, [](DepthEncoding& e) { e.farPlane *= 10; }); }},
        {"millimetres as metres", "scale",
         [](const Copy& from) { return restored(from, DepthEncoding(), [](float z) { return z * 1000; }); }},
        {"through 8 bits", "quantised",
         [](const Copy& from) {
             const float step = float(farthest(from)) / 255;
             return restored(from, DepthEncoding(),
                             [step](float z) { return step * std::clamp(std::round(z / step), 1.f, 255.f); });
         }},
        {"a camera of twice the size", "camera",
         [](const Copy& from) {
             Copy copy = from;
             Camera& c = copy.capture.frame.camera;
             c.fx *= 2, c.fy *= 2, c.cx *= 2, c.cy *= 2;
             return copy;
         }},
        {"a weapon in its own range", "overlay",
         [](const Copy& from) {
             Copy copy = restored(from, DepthEncoding(), [](float z) { return z; });
             cv::Mat& z = copy.capture.stored;
             const float least = float(depthStatistics(z).p1) / 8;
             for (int j = z.rows * 7 / 10; j < z.rows; ++j)
                 for (int i = z.cols * 6 / 10; i < z.cols * 8 / 10; ++i)
                     z.at<float>(j, i) = least * (1 + .5f * float(z.rows - j) / float(z.rows));
             return copy;
         }},
    };
    return all;
}

std::set<std::string> doubtsOf(const Copy& copy) {
    std::set<std::string> names;
    for (const Doubt& d : findDoubts(copy.capture, copy.encoding)) names.insert(d.name);
    return names;
}

std::string joined(const std::set<std::string>& names) {
    std::string out;
    for (const std::string& n : names) out += (out.empty() ? "" : ", ") + n;
    return out;
}

TEST(Inspect, NamesFaultsAndStaysQuietOnTrueCaptures) {
    const fs::path captures = BRUME_CAPTURES;
    if (captures.empty()) GTEST_SKIP() << "BRUME_CAPTURES is not set";
    std::string table = "| capture | as it is |";
    for (const Fault& f : faults()) table += " " + f.title + " |";
    table += "\n|---|---|";
    for (size_t k = 0; k < faults().size(); ++k) table += "---|";
    table += "\n";
    std::vector<int> named(faults().size()), made(faults().size());
    for (const std::string& name : trueCaptures()) {
        Copy truth;
        truth.capture = readCapture((captures / name).string());
        truth.encoding = truth.capture.stated ? *truth.capture.stated : *truth.capture.habit;
        const std::set<std::string> own = doubtsOf(truth);
        // One capture has a fault of its own: its far depths are cut to the top of 16 bits.
        const bool isCut = name == "lingbot/night_skatepark.jpg";
        EXPECT_EQ(own, isCut ? std::set<std::string>{"ceiling"} : std::set<std::string>{}) << name;
        table += "| " + name + " | " + (own.empty() ? "quiet" : joined(own) + ", rightly") + " |";
        for (size_t k = 0; k < faults().size(); ++k) {
            const std::optional<Copy> copy = faults()[k].make(truth);
            if (!copy) {
                table += " – |";
                continue;
            }
            ++made[k];
            std::set<std::string> found = doubtsOf(*copy);
            const bool hit = found.erase(faults()[k].doubt) > 0;
            named[k] += hit;
            table += std::string(hit ? " named" : " **missed**") +
                     (found.empty() ? "" : "; also " + joined(found)) + " |";
        }
        table += "\n";
    }
    table += "| named | |";
    for (size_t k = 0; k < faults().size(); ++k)
        table += " " + std::to_string(named[k]) + " of " + std::to_string(made[k]) + " |";
    table += "\n";

    const std::string begin = "<!-- table: written by the test Inspect -->\n", end = "<!-- end of table -->";
    const fs::path page = fs::path(BRUME_SOURCE_DIR) / "docs/INSPECT.md";
    std::ifstream in(page);
    std::string text((std::istreambuf_iterator<char>(in)), {});
    const size_t from = text.find(begin), to = text.find(end);
    ASSERT_TRUE(from != std::string::npos && to != std::string::npos) << page;
    if (std::getenv("BRUME_UPDATE_DOCS")) {
        text.replace(from + begin.size(), to - from - begin.size(), table);
        std::ofstream(page) << text;
        std::cout << table;
    } else {
        EXPECT_EQ(text.substr(from + begin.size(), to - from - begin.size()), table)
            << "docs/INSPECT.md tells something else; run this test with BRUME_UPDATE_DOCS=1 and look at the "
               "change";
    }
}

TEST(Inspect, RanksTheTrueReadingFirst) {
    const fs::path captures = BRUME_CAPTURES;
    if (captures.empty()) GTEST_SKIP() << "BRUME_CAPTURES is not set";
    const auto firstOf = [&](const std::string& name) {
        Capture capture = readCapture((captures / name).string());
        capture.stated.reset();
        const std::vector<Reading> readings = rankReadings(capture);
        EXPECT_GE(readings.size(), 4u);
        for (size_t k = 1; k < readings.size(); ++k) EXPECT_LE(readings[k].score, readings[k - 1].score);
        return readings.front().name;
    };
    EXPECT_EQ(firstOf("blender/flat_clear.exr"), "linear");
    EXPECT_EQ(firstOf("blender/night_clear.exr"), "linear");
    EXPECT_EQ(firstOf("habitat/skokloster_color.npy"), "linear");
    EXPECT_EQ(firstOf("openarena/islandctf.png"), "opengl:near=.1,far=1000");
    EXPECT_EQ(firstOf("openarena/oa_shine.png"), "opengl:near=.1,far=1000");
    // Integers are linear, but a scale cannot be told from geometry: 5000, 1000 and 256 a metre all give
    // rooms.
    EXPECT_TRUE(std::set<std::string>({"tum", "millimetres", "kitti"}).count(firstOf("tum/color.png")));
    EXPECT_TRUE(
        std::set<std::string>({"tum", "millimetres", "kitti"}).count(firstOf("promptda/library.jpg")));
}

TEST(Inspect, NumbersOutsideADepthBuffersRangeAreNamed) {
    Capture capture;
    capture.frame.color = cv::Mat(60, 80, CV_32FC4, cv::Scalar(.5, .5, .5, 1));
    capture.frame.camera = Camera::withHorizontalView({80, 60}, 60);
    const auto doubts = [&](const cv::Mat& stored, const char* encoding) {
        capture.stored = stored;
        std::string names;
        for (const Doubt& d : findDoubts(capture, parseDepthEncoding(encoding)))
            names += d.name + ": " + d.evidence + "\n";
        return names;
    };
    cv::Mat words(60, 80, CV_16U), floats;
    for (int j = 0; j < 60; ++j)
        for (int i = 0; i < 80; ++i) words.at<uint16_t>(j, i) = uint16_t(65535 - 40 * (j + 1) - i);
    words.convertTo(floats, CV_32F);
    for (const char* name : {"opengl:near=.1,far=1000", "reshade:near=.1,far=1000"}) {
        EXPECT_EQ(doubts(words, name).find("range"), std::string::npos) << doubts(words, name);
        EXPECT_EQ(doubts(floats, name).find("range: 100 % of the stored numbers"), 0u)
            << doubts(floats, name);
        EXPECT_EQ(doubts(floats, name).find("polarity"), std::string::npos) << "a consequence, not a cause";
    }
    EXPECT_EQ(doubts(floats, "opengl:near=.1,far=1000,range=0,range=65535").find("range"), std::string::npos);
}

TEST(Inspect, EverySensorsReachIsDoubtedBeyondAndOnlyThere) {
    for (const std::string& name : sensorEncodingNames()) {
        const DepthEncoding encoding = parseDepthEncoding(name);
        for (const double part : {.9, 1.1}) {
            Copy copy;
            copy.encoding = encoding;
            copy.capture.frame.color = test::randomColor({64, 48}, 0, 1, 1);
            copy.capture.frame.camera = Camera::withHorizontalView({64, 48}, 60);
            const double farthest = part * encoding.sensorReach / encoding.scaleToMetres;
            copy.capture.stored = cv::Mat(48, 64, CV_32F);
            for (int j = 0; j < 48; ++j) copy.capture.stored.row(j).setTo(farthest * (1 - j / 60.));
            EXPECT_EQ(doubtsOf(copy).count("scale"), part > 1) << name;
        }
    }
}

// Kinect's depth in TUM's layout: whoever takes 5000 a metre for millimetres gets a fog five times too thick.
class InspectFiles : public test::FrameTest {};
TEST_F(InspectFiles, ATumSequenceReadOtherwiseIsDoubted) {
    Capture capture;
    capture.frame.color = test::randomColor({64, 48}, 0, 1, 1);
    capture.frame.camera = Camera::withHorizontalView({64, 48}, 60);
    capture.stored = cv::Mat(48, 64, CV_16U);
    for (int j = 0; j < 48; ++j) capture.stored.row(j).setTo(10000 - 100 * j);
    capture.depthPath = file("depth/1.5.png");
    const auto scale = [&](const char* encoding) {
        for (const Doubt& d : findDoubts(capture, parseDepthEncoding(encoding)))
            if (d.name == "scale") return d.evidence;
        return std::string();
    };
    EXPECT_EQ(scale("millimetres"), "");
    writeText("rgb.txt", "");
    EXPECT_EQ(scale("millimetres"), "");
    writeText("depth.txt", "");
    EXPECT_NE(scale("millimetres").find("is it 1.06 to 2 m (--depth-encoding tum) instead of 5.3 to 10 m?"),
              std::string::npos)
        << scale("millimetres");
    EXPECT_EQ(scale("tum"), "");
    EXPECT_EQ(scale("linear:scale_to_metres=.0002,unknown=0"), "");
    std::filesystem::remove(file("rgb.txt"));
    writeText("associations.txt", "");
    EXPECT_NE(scale("realsense"), "");
}

TEST(Inspect, PicturesShowWhatIsThere) {
    Capture capture;
    capture.frame.color = test::randomColor({160, 120}, 0, 1, 1);
    capture.frame.camera = Camera::withHorizontalView({160, 120}, 60);
    capture.stored = cv::Mat(120, 160, CV_16U, cv::Scalar(2000));
    capture.stored(cv::Rect(0, 0, 160, 30)).setTo(0);
    const cv::Mat picture = inspectionPicture(decodeCapture(capture, parseDepthEncoding("millimetres")));
    EXPECT_EQ(picture.type(), CV_32FC4);
    EXPECT_GT(picture.cols, 2 * 160);
    EXPECT_EQ(picture.at<cv::Vec4f>(5, 200)[0], 0) << "unknown is black";
    EXPECT_GT(picture.at<cv::Vec4f>(100, 200)[0], .05f);
    const std::vector<Reading> readings = rankReadings(capture);
    EXPECT_GE(readingsPicture(capture, readings, 160).cols, 4 * 160);
}

}  // namespace
}  // namespace brume
