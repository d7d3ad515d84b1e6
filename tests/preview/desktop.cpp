#include "preview/desktop.hpp"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <thread>

#include "frame/read.hpp"
#include "frame/reader_line.hpp"

extern char** environ;

namespace brume::test {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

constexpr auto patience = std::chrono::seconds(isSanitized ? 300 : 60);
constexpr auto glance = std::chrono::milliseconds(8);

bool until(const std::function<bool()>& condition) {
    const auto end = std::chrono::steady_clock::now() + patience;
    while (!condition()) {
        if (std::chrono::steady_clock::now() > end) return false;
        std::this_thread::sleep_for(glance);
    }
    return true;
}

uint32_t bigEndian(const std::string& bytes, size_t word) {
    uint32_t value = 0;
    for (size_t k = 0; k < 4; k++) value = value << 8 | uint8_t(bytes[word * 4 + k]);
    return value;
}

bool isInstalled(const std::string& program) {
    return std::system(("command -v " + program + " >/dev/null").c_str()) == 0;
}

}  // namespace

// --- processes -----------------------------------------------------------------------------------

Child::Child(const std::vector<std::string>& words, const std::map<std::string, std::string>& environment,
             const std::string& folder, const std::string& log) {
    std::vector<char*> arguments;
    for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    process_ = fork();
    if (process_ != 0) return;
    for (const auto& [name, value] : environment)
        value.empty() ? unsetenv(name.c_str()) : setenv(name.c_str(), value.c_str(), 1);
    const int out = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    dup2(out, 1);
    dup2(out, 2);
    if (chdir(folder.c_str()) == 0) execvp(arguments[0], arguments.data());
    _exit(127);
}

bool Child::isRunning() {
    if (process_ < 0) return false;
    int status = 0;
    if (waitpid(process_, &status, WNOHANG) != process_) return true;
    status_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    process_ = -1;
    return false;
}

int Child::wait() {
    until([&] { return !isRunning(); });
    return process_ < 0 ? status_ : -1;
}

Child::~Child() {
    if (!isRunning()) return;
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
}

// --- the desktop ---------------------------------------------------------------------------------

Desktop* Desktop::instance() {
    if (!isInstalled("Xvfb") || !isInstalled("xdotool")) return nullptr;
    static Desktop desktop;
    return &desktop;
}

Desktop::Desktop() : folder_(testing::TempDir() + "brume-desktop-" + std::to_string(getpid())) {
    fs::create_directories(folder_);
    const std::string screen = std::to_string(width) + "x" + std::to_string(height) + "x24";
    const std::string number = folder_ + "/display";
    // The server chooses a number that is free, and says it on the descriptor.
    server_ = std::make_unique<Child>(
        std::vector<std::string>{"sh", "-c",
                                 "exec Xvfb -displayfd 3 -screen 0 " + screen +
                                     " -nolisten tcp -noreset -fbdir '" + folder_ + "' 3>'" + number + "'"},
        std::map<std::string, std::string>{}, folder_, folder_ + "/log");
    until([&] { return bytesOf(number).find('\n') != std::string::npos || !server_->isRunning(); });
    display_ = ":" + bytesOf(number);
    display_.erase(display_.find_last_not_of(" \n") + 1);
}

// The X window dump format: a header of 25 big-endian words, the window's name, the colour map, the rows.
cv::Mat Desktop::pixels() const {
    const std::string bytes = bytesOf(folder_ + "/Xvfb_screen0");
    const size_t header = bigEndian(bytes, 0), columns = bigEndian(bytes, 4), rows = bigEndian(bytes, 5);
    const size_t perLine = bigEndian(bytes, 12), colors = bigEndian(bytes, 19);
    const size_t start = header + colors * 12;
    if (bigEndian(bytes, 11) != 32 || bytes.size() < start + perLine * rows)
        throw std::runtime_error("no screen");
    cv::Mat picture(cv::Size(int(columns), int(rows)), CV_8UC3);
    for (size_t j = 0; j < rows; j++)
        for (size_t i = 0; i < columns; i++) {
            const char* p = bytes.data() + start + j * perLine + i * 4;  // blue, green, red, nothing
            picture.at<cv::Vec3b>(int(j), int(i)) = {uint8_t(p[2]), uint8_t(p[1]), uint8_t(p[0])};
        }
    return picture;
}

// --- the window ----------------------------------------------------------------------------------

void PreviewWindow::SetUp() {
    Program::SetUp();
    if (!Desktop::instance()) GTEST_SKIP() << "Xvfb or xdotool is not installed";
    environment_ = {{"DISPLAY", Desktop::instance()->display()},
                    {"XDG_CONFIG_HOME", path("config")},
                    {"BRUME_EFFECT_PATH", path("effects")},
                    {"WAYLAND_DISPLAY", ""}};
}

void PreviewWindow::TearDown() {
    window_.reset();
    if (HasFailure() && fs::exists(path("log"))) std::cerr << bytesOf(path("log"));
    Program::TearDown();
}

void PreviewWindow::start(const std::string& arguments, bool waits) {
    fs::remove(path("state.json"));
    std::vector<std::string> words = {BRUME_PROGRAM, "preview"};
    std::istringstream in(arguments);
    for (std::string word; in >> word;) words.push_back(word);
    for (const char* word : {"--size", "1180x760", "--state", "state.json", "--trace", "trace.jsonl"})
        words.push_back(word);
    window_ = std::make_unique<Child>(words, environment_, folder_, path("log"));
    if (waits) waitSettled();
}

void PreviewWindow::quit() {
    key("ctrl+q");
    EXPECT_EQ(window_->wait(), 0);
    window_.reset();
}

json PreviewWindow::state() const {
    const json now = json::parse(bytesOf(path("state.json")), nullptr, false);
    return now.is_object() ? now : json::object();
}

bool PreviewWindow::waitFor(const std::string& what, const std::function<bool(const json&)>& condition) {
    if (HasFailure())
        return false;  // what follows a failure tells nothing, and waiting for it takes a minute each
    json last;
    bool isGone = false;
    const bool holds = until([&] {
        last = state();
        isGone = window_ && !window_->isRunning();
        return (!last.empty() && condition(last)) || isGone;
    });
    last.erase("items");
    EXPECT_TRUE(holds && !isGone) << what << (isGone ? ": the window has ended" : ": did not come") << "\n"
                                  << last.dump(1);
    return holds && !isGone;
}

bool PreviewWindow::waitSettled() {
    return waitFor("a finished picture", [](const json& s) { return s.value("settled", false); });
}

void PreviewWindow::xdotool(const std::string& words) {
    const std::string line = "DISPLAY=" + Desktop::instance()->display() + " xdotool " + words;
    ASSERT_EQ(std::system(line.c_str()), 0) << line;
}

void PreviewWindow::move(double x, double y) {
    const int column = int(std::lround(x)), row = int(std::lround(y));
    xdotool("mousemove " + std::to_string(column) + " " + std::to_string(row));
    waitFor("the pointer", [&](const json& s) { return s["mouse"][0] == column && s["mouse"][1] == row; });
}

void PreviewWindow::press() {
    xdotool("mousedown 1");
    waitFor("the button down", [](const json& s) { return s["mouse"][2] == true; });
}

void PreviewWindow::release() {
    xdotool("mouseup 1");
    waitFor("the button up", [](const json& s) { return s["mouse"][2] == false; });
}

cv::Point2d PreviewWindow::middleOf(const std::string& item) {
    cv::Point2d middle;
    waitFor("the widget " + item, [&](const json& s) {
        if (!s["items"].contains(item) || s["moving"] == true) return false;
        const auto& area = s["items"][item];
        middle = {area[0].get<double>() + area[2].get<double>() / 2,
                  area[1].get<double>() + area[3].get<double>() / 2};
        return true;
    });
    return middle;
}

void PreviewWindow::click(const std::string& item) {
    const cv::Point2d at = middleOf(item);
    move(at.x, at.y);
    press();
    release();
}

void PreviewWindow::dragTo(cv::Point2d from, cv::Point2d to) {
    move(from.x, from.y);
    press();
    for (int k = 1; k <= 3; k++) move(from.x + (to.x - from.x) * k / 3, from.y + (to.y - from.y) * k / 3);
    release();
}

void PreviewWindow::drag(const std::string& item, double from, double to) {
    const cv::Point2d middle = middleOf(item);
    const double width = state()["items"][item][2];
    dragTo({middle.x + (from - .5) * width, middle.y}, {middle.x + (to - .5) * width, middle.y});
}

void PreviewWindow::key(const std::string& key) { xdotool("key " + key); }

void PreviewWindow::hold(const std::string& key, const std::string& what,
                         const std::function<bool(const json&)>& condition) {
    xdotool("keydown " + key);
    waitFor(what, condition);
    xdotool("keyup " + key);
}

void PreviewWindow::type(const std::string& words) { xdotool("type --delay 4 '" + words + "'"); }

cv::Mat PreviewWindow::picture() {
    const json at = state()["picture"];
    const cv::Rect area(int(std::lround(at[0].get<double>())), int(std::lround(at[1].get<double>())),
                        int(std::lround(at[2].get<double>())), int(std::lround(at[3].get<double>())));
    return Desktop::instance()->pixels()(area).clone();
}

void PreviewWindow::expectPicture(const cv::Mat& bytes, const std::string& what) {
    if (HasFailure()) return;
    double largest = -1;
    const bool isSame = until([&] {
        const cv::Mat now = picture();
        if (now.size() != bytes.size()) return false;
        largest = cv::norm(now, bytes, cv::NORM_INF);
        return largest == 0;
    });
    EXPECT_TRUE(isSame) << what << ": off by up to " << largest << " of 255";
}

cv::Mat PreviewWindow::applied(const std::string& arguments) {
    const Ran ran = run(folder_, "BRUME_EFFECT_PATH=effects BRUME apply " + arguments + " -o applied.png");
    EXPECT_EQ(ran.status, 0) << ran.err;
    const cv::Mat stored = readImage(path("applied.png"));  // fractions of 255
    cv::Mat bytes;
    stored.convertTo(bytes, CV_8U, 255);
    if (bytes.channels() == 4) cv::cvtColor(bytes, bytes, cv::COLOR_RGBA2RGB);
    return bytes;
}

}  // namespace brume::test
