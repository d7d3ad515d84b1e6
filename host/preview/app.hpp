// The window's whole state; panels draw and change it. Everything here lives on the main thread.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>

#include "frame/pending_file.hpp"
#include "preview/frame_loader.hpp"
#include "preview/options.hpp"
#include "preview/picture_view.hpp"
#include "preview/renderer.hpp"
#include "preview/screen_texture.hpp"
#include "preview/session.hpp"
#include "preview/settings.hpp"
#include "preview/ui_state.hpp"
#include "preview/window.hpp"

namespace brume::preview {

enum class Show { Result, Before, Wipe, Blink, Depth, Difference, Image };

/// How the picture is looked at. No part of the preset.
struct Look {
    Show show = Show::Result;
    std::string image = "transmittance";  ///< for Show::Image
    double wipe = .5;                     ///< 0..1 of the picture's width
    bool isDraggingWipe = false;
    PictureView view;
};

struct Playing {
    bool isOn = false;
    double framesPerSecond = 24;
    Clock::time_point next{};
};

class App {
  public:
    App(const PreviewOptions& options, Settings settings);
    ~App();
    void run();

    // --- what panels use ---
    const PreviewOptions options;
    Settings settings;
    Window window;
    UiState ui;
    Session session;
    Look look;
    Playing playing;
    std::string backend;

    std::shared_ptr<const LoadedFrame> loaded;     ///< the current frame; the last one until it is there
    std::shared_ptr<const Inspection> inspection;  ///< of it, or null
    std::shared_ptr<const Rendered> rendered;      ///< the newest that went well
    std::string renderError;                       ///< of the newest, if it did not
    ScreenTexture after, before;
    std::map<std::string, ScreenTexture> thumbnails;

    const bool isSoftware;  ///< llvmpipe draws the window
    bool isHelpOpen = false, isDragging = false, isQuitting = false;
    std::string popup;                ///< to open in this frame: "save preset", "save image", "open"
    std::string screenshotWanted;     ///< a file to write the window to, as drawn in this frame
    std::optional<cv::Point> probed;  ///< the pixel under the pointer
    double frameRate = 0;             ///< pictures a second lately reached the window
    double lastLatency = 0;           ///< ms from input to picture, of the last change

    /// The session's chain with what the frame's sidecar supplies; current also after an edit of this frame.
    const Chain& effective();
    bool isBusy() const { return renderer_->isBusy(); }
    /// Runs what may throw; the sentence goes to the status line.
    template <class Action>
    void attempt(Action&& action) {
        try {
            action();
        } catch (const std::exception& e) {
            session.say(e.what(), true);
        }
    }
    void show(Show what, const std::string& image = "");
    void goTo(size_t frame);
    void togglePlay();
    void copyApplyLine();
    void saveImage(const std::string& path);
    void writeScreenshot(const std::string& path);
    void saveScreenshot(const std::string& path);

  private:
    void failWhereNoPictureComes() const;
    void readFrames();
    void submit();
    void takeResults();
    void advance();
    void draw();
    std::unique_ptr<Runner> makeRunner(const std::string& name) const;
    void presented(Clock::time_point inputTime);
    void writeState();
    double waitSeconds() const;

    // What was asked of the renderer last.
    struct Asked {
        uint64_t revision = 0, programs = 0;
        const void* frame = nullptr;
        std::string backend, image;
        bool difference = false, withCaptured = false, keepTransmittance = false;
        bool operator==(const Asked&) const = default;
    } asked_;
    bool isAskedHurried_ = false;
    std::unique_ptr<Renderer> renderer_;
    std::unique_ptr<FrameLoader> loader_;
    uint64_t framesRevision_ = 0;
    std::deque<std::pair<uint64_t, Clock::time_point>> inputs_;  // revision and when its input came
    uint64_t seenRevision_ = 0, shownRevision_ = 0;
    Chain effective_;
    std::pair<uint64_t, const void*> effectiveOf_{};
    std::deque<Clock::time_point> shown_;
    std::optional<GrowingFile> trace_;
    Clock::time_point nextPoll_{};
    int redraws_ = 3;
    std::string title_;
    uint64_t pictures_ = 0, drawn_ = 0;
};

// Each panel in a file of its own.
void drawToolbar(App& app);
void drawPicture(App& app);
void drawProbe(App& app);
void drawSidebar(App& app);
void drawStack(App& app);
void drawFramePanel(App& app);
void drawTiming(App& app);
void drawTimeline(App& app);
void drawStatus(App& app);
void drawHelp(App& app);
void drawPopups(App& app);
/// Parameters of one step, as rows of label, widget and reset.
void drawParameters(App& app, size_t step);
/// The rows of a list parameter. True if `value` was changed.
bool drawListTable(App& app, const std::string& name, const Parameter& parameter, ParameterValue& value);
/// One value's widget, as wide as there is room. True if `value` was changed.
bool drawValue(App& app, const std::string& name, const Parameter& parameter, ParameterValue& value,
               const std::vector<std::string>& images);
void runShortcuts(App& app);

}  // namespace brume::preview
