#include "preview/app.hpp"

#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "cpu/cpu_runner.hpp"
#include "error.hpp"
#include "gl/gl_runner.hpp"
#include "nearest_name.hpp"
#include "preview/probe.hpp"
#include "preview/stack.hpp"
#include "preview/theme.hpp"

namespace brume::preview {

namespace {

void requireImage(const std::string& name, std::vector<std::string> known) {
    known.insert(known.end(), {"color", "captured"});
    if (std::find(known.begin(), known.end(), name) != known.end()) return;
    known.insert(known.end(), {"result", "before", "wipe", "blink", "depth", "difference"});
    failUsage("--show: no image '", name, "'", suggestion(name, known));
}

double millisecondsBetween(Clock::time_point a, Clock::time_point b) {
    return std::chrono::duration<double, std::milli>(b - a).count();
}

// On the thread that has the window's context.
bool drawsInSoftware(const Window& window) {
    const auto* renderer = reinterpret_cast<const char*>(window.gl().GetString(GL_RENDERER));
    return renderer && std::string(renderer).find("llvmpipe") != std::string::npos;
}

// "auto" takes GL where a real GPU draws the window, or where an effect has no CPU half; as apply does.
std::string chosenBackend(const std::string& wanted, bool isSoftware, const Chain& chain) {
    if (wanted != "auto") return wanted;
    return isSoftware && !chain.needsGl() ? "cpu" : "gl";
}

}  // namespace

App::App(const PreviewOptions& given, Settings remembered)
    : options(given),
      settings(std::move(remembered)),
      window(given.window.empty() ? settings.window : given.window, "brume"),
      ui(given.state),
      session(EffectRegistry::standard()),
      isSoftware(drawsInSoftware(window)) {
    session.say("F1 shows keys and gestures");
    if (!options.trace.empty()) trace_.emplace(options.trace, "");
    settings.tab += "!";  // the one to open
    session.limitPixels(size_t(options.maxPixels));
    if (!options.words.frames.empty()) session.openFrames(options.words);
    if (!options.preset.empty()) session.openPreset(options.preset);
    playing.framesPerSecond = options.words.framesPerSecond;
    backend = chosenBackend(options.backend, isSoftware, session.chain());
    const std::vector<std::pair<std::string, Show>> shows = {
        {"result", Show::Result}, {"before", Show::Before}, {"wipe", Show::Wipe},
        {"blink", Show::Blink},   {"depth", Show::Depth},   {"difference", Show::Difference}};
    look.show = Show::Image;
    look.image = options.show;
    for (const auto& [name, value] : shows)
        if (name == options.show) show(value);
    if (look.show == Show::Image) requireImage(options.show, namedImages(session.chain()));

    IMGUI_CHECKVERSION();
    ImGui::CreateContext();
    ImGui::GetIO().IniFilename = nullptr;
    ImGui::GetIO().ConfigWindowsMoveFromTitleBarOnly = true;
    applyTheme(window.contentScale());
    ImGui_ImplGlfw_InitForOpenGL(window.handle(), true);
    ImGui_ImplOpenGL3_Init("#version 450");

    renderer_ = std::make_unique<Renderer>([this](const std::string& name) { return makeRunner(name); },
                                           Window::wake);
    loader_ = std::make_unique<FrameLoader>(Window::wake);
}

// GLSL runs in a second context of the window's driver, on a thread of its own. llvmpipe draws everything of
// one screen in turn, so there the window would wait for a slow chain: OSMesa, which apply would take there,
// does not.
std::unique_ptr<Runner> App::makeRunner(const std::string& name) const {
    if (name == "cpu") return makeCpuRunner();
    if (isSoftware) return makeGlRunner(GlPlatform::Osmesa);
    return makeGlRunner(std::make_shared<GlThread>([this] { return window.makeWorkerContext(); }));
}

App::~App() {
    window.hide();
    renderer_.reset();
    loader_.reset();
    thumbnails.clear();
    after.release();
    before.release();
    ImGui_ImplOpenGL3_Shutdown();
    ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext();
    if (options.window.empty()) settings.window = window.size();
    if (settings.tab.ends_with('!')) settings.tab.pop_back();
    if (options.screenshot.empty()) settings.save();
}

// --- the loop ------------------------------------------------------------------------------------

double App::waitSeconds() const {
    if (redraws_ > 0) return 0;
    if (playing.isOn)
        return std::clamp(std::chrono::duration<double>(playing.next - Clock::now()).count(), .001, .1);
    return .1;
}

void App::run() {
    while (!window.isClosing() && !isQuitting) {
        const bool hadEvent = window.waitEvents(waitSeconds());
        const auto inputTime = Clock::now();
        if (hadEvent || look.show == Show::Blink) redraws_ = 3;  // ImGui needs a few frames to settle
        if (const auto dropped = window.takeDropped(); !dropped.empty())
            attempt([&] { session.openAny(dropped); });
        if (inputTime >= nextPoll_) {
            const auto before = session.revision();
            const std::string said = session.fileError() + session.message().text;
            session.pollFiles();
            if (before != session.revision() || said != session.fileError() + session.message().text)
                redraws_ = 3;
            nextPoll_ = inputTime + std::chrono::milliseconds(80);
        }
        readFrames();
        takeResults();
        advance();
        if (!options.screenshot.empty()) failWhereNoPictureComes();
        if (redraws_ <= 0) {
            submit();
            continue;
        }
        redraws_--;
        draw();
        if (session.revision() != seenRevision_) {
            seenRevision_ = session.revision();
            if (rendered) inputs_.emplace_back(seenRevision_, inputTime);
        }
        submit();
        if (!options.screenshot.empty() && rendered && rendered->isFinal && !isBusy() && redraws_ == 0 &&
            (inspection || !loaded)) {
            writeScreenshot(options.screenshot);
            isQuitting = true;
        }
        if (!screenshotWanted.empty()) saveScreenshot(std::exchange(screenshotWanted, ""));
        window.swap();
        presented(inputTime);
        writeState();
    }
}

// With --screenshot nobody is there to mend what is wrong.
void App::failWhereNoPictureComes() const {
    if (const std::string error = loader_->error(); !error.empty()) failIo(error);
    if (!renderError.empty() && !isBusy()) failUsage(renderError);
}

void App::readFrames() {
    if (session.frames().empty()) return;
    if (framesRevision_ != session.framesRevision()) {
        framesRevision_ = session.framesRevision();
        loader_->open(session.frames(), session.readOptions(), playing.framesPerSecond);
        inspection.reset();
        thumbnails.clear();
    }
    const size_t count = session.frames().size();
    std::optional<size_t> next;
    if (playing.isOn && count > 1) next = (session.current() + 1) % count;
    loader_->want(session.current(), !playing.isOn, next);
    if (auto frame = loader_->frame(); frame && frame != loaded) {
        loaded = frame;
        redraws_ = 3;
    }
    if (auto found = loader_->inspection(); found != inspection) {
        inspection = found;
        thumbnails.clear();
        redraws_ = 3;
    }
    if (const std::string error = loader_->error(); !error.empty() && error != session.message().text) {
        session.say(error, true);
        redraws_ = 3;
    }
}

void App::submit() {
    if (!loaded) return;
    const bool isMoving = isDragging || playing.isOn;
    Asked wish;
    wish.revision = session.revision();
    wish.programs = session.programs();
    wish.frame = loaded.get();
    wish.backend = backend;
    wish.image = look.show == Show::Depth ? "depth" : look.show == Show::Image ? look.image : "color";
    wish.difference = look.show == Show::Difference;
    wish.withCaptured = look.show == Show::Before || look.show == Show::Wipe || look.show == Show::Blink;
    wish.keepTransmittance = settings.probe && !isMoving;
    if (isMoving && asked_.keepTransmittance) {  // what was asked for has it already
        Asked with = wish;
        with.keepTransmittance = true;
        if (with == asked_) return;
    }
    if (wish == asked_ && (isMoving || !isAskedHurried_)) return;
    asked_ = wish;
    isAskedHurried_ = isMoving;
    RenderJob job;
    job.revision = wish.revision;
    job.chain = session.chainToRender();
    job.frame = std::shared_ptr<const FramePair>(loaded, &loaded->frame);
    job.backend = backend;
    job.image = wish.image;
    job.difference = wish.difference;
    job.withCaptured = wish.withCaptured;
    job.keepTransmittance = wish.keepTransmittance;
    job.isHurried = isMoving;
    job.programs = wish.programs;
    renderer_->submit(std::move(job));
}

void App::takeResults() {
    auto news = renderer_->take();
    if (!news) return;
    redraws_ = std::max(redraws_, 2);
    session.rendered(news->job.revision, news->error);
    renderError = news->error;
    if (!news->error.empty()) return;
    rendered = news;
    after.upload(window.gl(), news->shown);
    if (!news->captured.empty()) before.upload(window.gl(), news->captured);
    pictures_++;
}

void App::advance() {
    if (!playing.isOn || session.frames().size() < 2) return;
    const auto now = Clock::now();
    if (now < playing.next || !loaded || loaded->index != session.current()) return;
    if (!rendered || rendered->job.frame.get() != &loaded->frame) return;  // every frame is shown
    const size_t next = session.current() + 1;
    if (next < session.frames().size())
        session.goTo(next);
    else if (settings.loop)
        session.goTo(0);
    else
        playing.isOn = false;
    const auto step = std::chrono::duration_cast<Clock::duration>(
        std::chrono::duration<double>(1 / playing.framesPerSecond));
    playing.next = std::max(playing.next + step, now);
    redraws_ = std::max(redraws_, 1);
}

const Chain& App::effective() {
    const std::pair<uint64_t, const void*> now{session.revision(), loaded.get()};
    if (now == effectiveOf_ && effective_.steps.size() == session.chain().steps.size()) return effective_;
    effectiveOf_ = now;
    effective_ = session.chain();
    if (loaded) try {
            effective_ = withSidecar(session.chain(), loaded->frame);
        } catch (const Error&) {  // the renderer says it
        }
    return effective_;
}

void App::draw() {
    ImGui_ImplOpenGL3_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    ImGui::NewFrame();
    ui.beginFrame();
    isDragging = false;
    runShortcuts(*this);

    const ImVec2 size = ImGui::GetIO().DisplaySize;
    const float scale = float(window.contentScale());
    const float sidebar = std::min(float(settings.sidebar) * scale, size.x * .6f);
    const float status = ImGui::GetFrameHeight() + 6 * scale;
    const float timeline = session.frames().size() > 1 ? ImGui::GetFrameHeight() + 12 * scale : 0;
    const auto flags = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                       ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus;
    auto panel = [&](const char* name, float x, float y, float width, float height, void (*content)(App&),
                     ImVec2 padding) {
        ImGui::SetNextWindowPos({x, y});
        ImGui::SetNextWindowSize({width, height});
        ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, padding);
        ImGui::Begin(name, nullptr, flags);
        ImGui::PopStyleVar();
        content(*this);
        ImGui::End();
    };
    const float bar = ImGui::GetFrameHeight() + 14 * scale;
    const float left = size.x - sidebar;
    panel("toolbar", 0, 0, left, bar, drawToolbar, {8 * scale, 7 * scale});
    panel("picture", 0, bar, left, size.y - bar - status - timeline, drawPicture, {0, 0});
    if (timeline > 0)
        panel("timeline", 0, size.y - status - timeline, left, timeline, drawTimeline,
              {8 * scale, 6 * scale});
    panel("status", 0, size.y - status, size.x, status, drawStatus, {10 * scale, 3 * scale});
    panel("sidebar", left, 0, sidebar, size.y - status, drawSidebar, {10 * scale, 8 * scale});
    drawPopups(*this);
    drawHelp(*this);
    // A drag that has ended is one step back.
    if (ImGui::IsAnyItemActive() && ImGui::IsMouseDown(ImGuiMouseButton_Left)) isDragging = true;
    if (!isDragging) session.endDrag();

    ImGui::Render();
    const cv::Size pixels = window.framebufferSize();
    window.gl().Viewport(0, 0, pixels.width, pixels.height);
    window.gl().ClearColor(.1f, .1f, .11f, 1);
    window.gl().Clear(GL_COLOR_BUFFER_BIT);
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
    const std::string title = (session.isSaved() ? "" : "• ") +
                              (session.presetName().empty() ? "no preset" : session.presetName()) +
                              " – brume";
    if (title != title_) window.setTitle(title_ = title);
}

void App::presented(Clock::time_point) {
    if (!rendered || rendered->job.revision == shownRevision_) return;
    window.gl().Finish();
    const auto now = Clock::now();
    shownRevision_ = rendered->job.revision;
    double latency = -1;
    while (!inputs_.empty() && inputs_.front().first <= shownRevision_) {
        latency = millisecondsBetween(inputs_.front().second, now);  // of the newest input that it shows
        inputs_.pop_front();
    }
    shown_.push_back(now);
    while (shown_.size() > 30 || (shown_.size() > 1 && millisecondsBetween(shown_.front(), now) > 2000))
        shown_.pop_front();
    frameRate = shown_.size() > 1
                    ? double(shown_.size() - 1) * 1000 / millisecondsBetween(shown_.front(), shown_.back())
                    : 0;
    if (latency < 0) return;
    lastLatency = latency;
    if (trace_)
        trace_->append(nlohmann::json{{"revision", shownRevision_},
                                      {"input_to_picture_ms", latency},
                                      {"scale", rendered->scale},
                                      {"hurried", rendered->job.isHurried},
                                      {"run_ms", rendered->runMilliseconds},
                                      {"show_ms", rendered->showMilliseconds}}
                           .dump() +
                       "\n");
}

void App::writeState() {
    if (!ui.isOn()) return;
    const ImGuiIO& io = ImGui::GetIO();
    ui.set("drawn", ++drawn_);
    ui.set("mouse", {io.MousePos.x, io.MousePos.y, io.MouseDown[0]});
    ui.set("moving", redraws_ > 0 && !playing.isOn);
    ui.set("typing", io.WantTextInput);
    ui.set("control", io.KeyCtrl);
    ui.set("loaded", loaded != nullptr);
    ui.set("tab", settings.tab);
    ui.set("fit", look.view.isFit());
    if (rendered && rendered->difference)
        ui.set("difference",
               {{"largest", rendered->difference->largest}, {"unlike", rendered->difference->unlike}});
    ui.set("revision", session.revision());
    ui.set("shown_revision", shownRevision_);
    ui.set("pictures", pictures_);
    ui.set("scale", rendered ? rendered->scale : 0);
    ui.set("settled", rendered && rendered->isFinal && rendered->job.revision == session.revision() &&
                          !isBusy() && loaded && loaded->index == session.current());
    ui.set("latency_ms", lastLatency);
    ui.set("error", session.fileError().empty() ? renderError : session.fileError());
    ui.set("message", session.message().text);
    ui.set("saved", session.isSaved());
    ui.set("frame", session.current());
    ui.set("frames", session.frames().size());
    ui.set("playing", playing.isOn);
    ui.set("backend", backend);
    ui.set("show", int(look.show));
    ui.set("zoom", look.view.zoom());
    ui.set("wipe", look.wipe);
    ui.set("preset", nlohmann::json::parse(writePreset(session.chain())));
    ui.set("inspected", inspection != nullptr);
    ui.set("help", isHelpOpen);
    if (probed && loaded) {
        nlohmann::json lines = nlohmann::json::object();
        for (const auto& [label, value] : probeLines(probeAt(*loaded, rendered.get(), *probed)))
            lines[label] = value;
        ui.set("probe", lines);
    }
    const cv::Point2d corner = look.view.toWindow({0, 0});
    ui.set("picture", {corner.x, corner.y, look.view.picture().width * look.view.zoom(),
                       look.view.picture().height * look.view.zoom()});
    ui.endFrame();
}

}  // namespace brume::preview

extern "C" __attribute__((visibility("default"))) void brumeRunPreview(
    const brume::preview::PreviewOptions& options) {
    brume::preview::App(options, brume::preview::Settings::load()).run();
}

static_assert(std::is_same_v<decltype(brumeRunPreview), brume::preview::RunPreviewFunction>);
