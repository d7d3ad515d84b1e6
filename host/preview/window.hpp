// The window, and a second context of the same driver for the thread that runs chains.
#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <utility>
#include <vector>

#include "gl/context.hpp"
#include "gl/functions.hpp"

struct GLFWwindow;

namespace brume::preview {

/// Lives on the main thread; there may be one.
class Window {
  public:
    /// Throws Error (Usage): no display, or no OpenGL 4.5 core.
    Window(cv::Size size, const std::string& title);
    ~Window();
    Window(const Window&) = delete;
    Window& operator=(const Window&) = delete;

    GLFWwindow* handle() const { return window_; }
    const GlFunctions& gl() const { return gl_; }
    double contentScale() const;
    cv::Size size() const;             ///< screen coordinates
    cv::Size framebufferSize() const;  ///< px
    void setTitle(const std::string& title);

    /// Waits for an event, at most that long. True if there was one.
    bool waitEvents(double seconds);
    bool isClosing() const;
    void swap();
    /// What was drawn last, before swap: CV_8UC3 RGB, top row first.
    cv::Mat readPixels() const;
    /// Keys pressed or repeating since the last call, in order: none is lost however slow a frame is.
    struct Key {
        int key = 0;  ///< GLFW's
        bool control = false, shift = false, isRepeat = false;
    };
    std::vector<Key> takeKeys() { return std::move(keys_); }
    std::vector<std::string> takeDropped() { return std::move(dropped_); }

    /// Gone from the screen at once, whatever still has to be waited for.
    void hide();
    /// For a GlThread: makes the second context current there. Called once.
    std::unique_ptr<GlContext> makeWorkerContext() const;
    /// From any thread: waitEvents returns.
    static void wake();

  private:
    void listen();

    GLFWwindow *window_ = nullptr, *worker_ = nullptr;
    GlFunctions gl_;
    bool hadEvent_ = true;
    std::vector<Key> keys_;
    std::vector<std::string> dropped_;
};

}  // namespace brume::preview
