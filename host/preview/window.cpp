#include "preview/window.hpp"

#include <GLFW/glfw3.h>

#include <opencv2/core.hpp>

#include "error.hpp"

namespace brume::preview {

namespace {

std::string lastError() {
    const char* sentence = nullptr;
    glfwGetError(&sentence);
    return sentence ? sentence : "no reason given";
}

class WorkerContext final : public GlContext {
  public:
    explicit WorkerContext(GLFWwindow* window) {
        glfwMakeContextCurrent(window);
        functions_ = loadGlFunctions(glfwGetProcAddress);
    }
    ~WorkerContext() override { glfwMakeContextCurrent(nullptr); }
    const GlFunctions& functions() const override { return functions_; }
    std::string platform() const override { return "window"; }

  private:
    GlFunctions functions_;
};

GLFWwindow* create(cv::Size size, const std::string& title, bool isVisible) {
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_VISIBLE, isVisible);
    glfwWindowHint(GLFW_DEPTH_BITS, 0);
    glfwWindowHint(GLFW_STENCIL_BITS, 0);
    return glfwCreateWindow(size.width, size.height, title.c_str(), nullptr, nullptr);
}

}  // namespace

Window::Window(cv::Size size, const std::string& title) {
    if (!glfwInit())
        failUsage("preview: there is no display (", lastError(),
                  "); run it on a desktop, through ssh -X, or under xvfb-run, or use brume apply");
    window_ = create(size, title, true);
    const std::string reason = window_ ? "" : lastError();
    if (window_) worker_ = create({16, 16}, "brume", false);
    if (!worker_) {
        const std::string why = window_ ? lastError() : reason;
        glfwTerminate();
        failUsage("preview: this display gives no OpenGL 4.5 core (", why,
                  "); update the graphics driver, try LIBGL_ALWAYS_SOFTWARE=1, or use brume apply");
    }
    glfwMakeContextCurrent(window_);
    glfwSwapInterval(1);
    gl_ = loadGlFunctions(glfwGetProcAddress);
    glfwSetWindowSizeLimits(window_, 640, 400, GLFW_DONT_CARE, GLFW_DONT_CARE);
    listen();
}

Window::~Window() { glfwTerminate(); }

// Before ImGui's own callbacks, which call these in turn.
void Window::listen() {
    glfwSetWindowUserPointer(window_, this);
    static auto heard = [](GLFWwindow* w) {
        static_cast<Window*>(glfwGetWindowUserPointer(w))->hadEvent_ = true;
    };
    glfwSetKeyCallback(window_, [](GLFWwindow* w, int key, int, int action, int mods) {
        heard(w);
        if (action == GLFW_RELEASE) return;
        static_cast<Window*>(glfwGetWindowUserPointer(w))
            ->keys_.push_back(
                {key, bool(mods & GLFW_MOD_CONTROL), bool(mods & GLFW_MOD_SHIFT), action == GLFW_REPEAT});
    });
    glfwSetCharCallback(window_, [](GLFWwindow* w, unsigned) { heard(w); });
    glfwSetMouseButtonCallback(window_, [](GLFWwindow* w, int, int, int) { heard(w); });
    glfwSetScrollCallback(window_, [](GLFWwindow* w, double, double) { heard(w); });
    glfwSetCursorPosCallback(window_, [](GLFWwindow* w, double, double) { heard(w); });
    glfwSetCursorEnterCallback(window_, [](GLFWwindow* w, int) { heard(w); });
    glfwSetWindowFocusCallback(window_, [](GLFWwindow* w, int) { heard(w); });
    glfwSetFramebufferSizeCallback(window_, [](GLFWwindow* w, int, int) { heard(w); });
    glfwSetWindowRefreshCallback(window_, [](GLFWwindow* w) { heard(w); });
    glfwSetWindowCloseCallback(window_, [](GLFWwindow* w) { heard(w); });
    glfwSetDropCallback(window_, [](GLFWwindow* w, int count, const char** paths) {
        heard(w);
        auto& dropped = static_cast<Window*>(glfwGetWindowUserPointer(w))->dropped_;
        dropped.assign(paths, paths + count);
    });
}

double Window::contentScale() const {
    float x = 1, y = 1;
    glfwGetWindowContentScale(window_, &x, &y);
    return x;
}

cv::Size Window::size() const {
    cv::Size size;
    glfwGetWindowSize(window_, &size.width, &size.height);
    return size;
}

cv::Size Window::framebufferSize() const {
    cv::Size size;
    glfwGetFramebufferSize(window_, &size.width, &size.height);
    return size;
}

void Window::setTitle(const std::string& title) { glfwSetWindowTitle(window_, title.c_str()); }

bool Window::waitEvents(double seconds) {
    if (seconds > 0)
        glfwWaitEventsTimeout(seconds);
    else
        glfwPollEvents();
    return std::exchange(hadEvent_, false);
}

bool Window::isClosing() const { return glfwWindowShouldClose(window_); }

void Window::hide() {
    glfwHideWindow(window_);
    glfwPollEvents();
}

void Window::swap() { glfwSwapBuffers(window_); }

cv::Mat Window::readPixels() const {
    const cv::Size size = framebufferSize();
    cv::Mat pixels(size, CV_8UC3), upright;
    gl_.ReadBuffer(GL_BACK);
    gl_.PixelStorei(GL_PACK_ALIGNMENT, 1);
    gl_.ReadPixels(0, 0, size.width, size.height, GL_RGB, GL_UNSIGNED_BYTE, pixels.data);
    gl_.PixelStorei(GL_PACK_ALIGNMENT, 4);
    cv::flip(pixels, upright, 0);
    return upright;
}

std::unique_ptr<GlContext> Window::makeWorkerContext() const {
    return std::make_unique<WorkerContext>(worker_);
}

void Window::wake() { glfwPostEmptyEvent(); }

}  // namespace brume::preview
