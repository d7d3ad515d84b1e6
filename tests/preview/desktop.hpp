// A desktop of its own (Xvfb) with the real program in it, worked by real key presses and mouse moves
// (xdotool) and looked at through the screen's own pixels.
#pragma once

#include <sys/types.h>

#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/core/mat.hpp>
#include <string>

#include "host/program.hpp"

namespace brume::test {

/// A child process; ended with the object.
class Child {
  public:
    /// `environment` is added to ours; an empty value takes the variable away. Output goes to `log`.
    Child(const std::vector<std::string>& words, const std::map<std::string, std::string>& environment,
          const std::string& folder, const std::string& log);
    ~Child();
    Child(const Child&) = delete;
    Child& operator=(const Child&) = delete;
    bool isRunning();
    /// Waits for its end; -1 if it does not come.
    int wait();

  private:
    pid_t process_ = -1;
    int status_ = -1;
};

/// One X server for all tests of this program.
class Desktop {
  public:
    /// Null where Xvfb or xdotool is not installed.
    static Desktop* instance();
    const std::string& display() const { return display_; }
    /// What is on the screen: CV_8UC3 RGB.
    cv::Mat pixels() const;
    static constexpr int width = 1180, height = 760;

  private:
    Desktop();
    std::string folder_, display_;
    std::unique_ptr<Child> server_;
};

/// A test that works the window.
class PreviewWindow : public Program {
  protected:
    void SetUp() override;
    void TearDown() override;

    /// `brume preview ARGUMENTS`; waits for the first finished picture unless told otherwise.
    void start(const std::string& arguments, bool waits = true);
    /// Closes it by its key and waits for its end.
    void quit();

    nlohmann::json state() const;
    /// Waits until it holds, however slow the machine; fails the test after a minute, saying `what`.
    bool waitFor(const std::string& what, const std::function<bool(const nlohmann::json&)>& condition);
    bool waitSettled();

    void move(double x, double y);
    void press();
    void release();
    /// The middle of a widget by the name that the window gives it.
    cv::Point2d middleOf(const std::string& item);
    void click(const std::string& item);
    /// From one place of a widget's width to another, in steps as a hand would.
    void drag(const std::string& item, double from, double to);
    void dragTo(cv::Point2d from, cv::Point2d to);
    /// As xdotool names it: "w", "ctrl+z".
    void key(const std::string& key);
    /// Held until the condition holds.
    void hold(const std::string& key, const std::string& what,
              const std::function<bool(const nlohmann::json&)>& condition);
    void type(const std::string& words);

    /// The picture's part of the screen, at one pixel for one ("1" was pressed), the pointer elsewhere.
    cv::Mat picture();
    /// Waits until the picture on the screen is exactly that.
    void expectPicture(const cv::Mat& bytes, const std::string& what);
    /// What `brume apply` writes.
    cv::Mat applied(const std::string& arguments);
    /// The preset of the window, as it would be saved.
    nlohmann::json preset() const { return state()["preset"]; }

    void xdotool(const std::string& words);

    std::map<std::string, std::string> environment_;

  private:
    std::unique_ptr<Child> window_;
};

}  // namespace brume::test
