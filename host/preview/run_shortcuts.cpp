// What each key does.
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <filesystem>

#include "file_status.hpp"
#include "preview/app.hpp"
#include "preview/shortcuts.hpp"
#include "preview/stack.hpp"

namespace brume::preview {

namespace {

void nextImage(App& app) {
    const auto names = namedImages(app.session.chain());
    auto at = std::find(names.begin(), names.end(), app.look.image);
    if (app.look.show == Show::Image && at != names.end()) ++at;
    app.show(Show::Image, at == names.end() ? names.front() : *at);
}

std::string freeName(const std::string& stem, const std::string& ending) {
    for (int k = 1;; k++) {
        const std::string name = stem + (k == 1 ? "" : std::to_string(k)) + ending;
        if (!isThere(name)) return name;
    }
}

void run(App& app, Action action) {
    const size_t frame = app.session.current();
    switch (action) {
        case Action::Result:
            return app.show(Show::Result);
        case Action::Before:
            return app.show(Show::Before);
        case Action::Wipe:
            return app.show(Show::Wipe);
        case Action::Blink:
            return app.show(Show::Blink);
        case Action::Depth:
            return app.show(Show::Depth);
        case Action::Difference:
            return app.show(Show::Difference);
        case Action::NextImage:
            return nextImage(app);
        case Action::Probe:
            app.settings.probe = !app.settings.probe;
            return;
        case Action::Fit:
            return app.look.view.fit();
        case Action::OneToOne:
            return app.look.view.zoomTo(1, app.look.view.middle());
        case Action::ZoomIn:
            return app.look.view.zoomBy(1.25, app.look.view.middle());
        case Action::ZoomOut:
            return app.look.view.zoomBy(.8, app.look.view.middle());
        case Action::Undo:
            return app.session.undo();
        case Action::Redo:
            return app.session.redo();
        case Action::SavePreset:
            app.popup = "save preset";
            return;
        case Action::SaveImage:
            app.popup = "save image";
            return;
        case Action::Open:
            app.popup = "open";
            return;
        case Action::AddEffect:
            app.popup = "add effect";
            return;
        case Action::CopyApply:
            return app.copyApplyLine();
        case Action::NextFrame:
            return app.goTo(frame + 1);
        case Action::PreviousFrame:
            return app.goTo(frame > 0 ? frame - 1 : 0);
        case Action::FirstFrame:
            return app.goTo(0);
        case Action::LastFrame:
            return app.goTo(SIZE_MAX);
        case Action::Play:
            return app.togglePlay();
        case Action::Backend:
            app.backend = app.backend == "cpu" ? "gl" : "cpu";
            return;
        case Action::Effects:
            app.settings.tab = "Effects!";
            return;
        case Action::Frame:
            app.settings.tab = "Frame!";
            return;
        case Action::Timing:
            app.settings.tab = "Timing!";
            return;
        case Action::Screenshot:
            app.screenshotWanted = freeName("brume_preview", ".png");
            return;
        case Action::Help:
            app.isHelpOpen = !app.isHelpOpen;
            return;
        case Action::Quit:
            app.isQuitting = true;
            return;
    }
}

}  // namespace

void runShortcuts(App& app) {
    const auto keys = app.window.takeKeys();
    const bool isTyping = ImGui::GetIO().WantTextInput || ImGui::IsPopupOpen("", ImGuiPopupFlags_AnyPopupId);
    for (const Window::Key& key : keys) {
        if (key.key == GLFW_KEY_ESCAPE) app.isHelpOpen = false;
        if (isTyping || !app.popup.empty()) continue;
        if (key.control && key.shift && key.key == GLFW_KEY_Z) app.session.redo();
        if (!key.control && key.key == GLFW_KEY_KP_ADD) run(app, Action::ZoomIn);
        if (!key.control && key.key == GLFW_KEY_KP_SUBTRACT) run(app, Action::ZoomOut);
        for (const Shortcut& shortcut : shortcuts()) {
            const bool mayRepeat = shortcut.repeats || !key.isRepeat;
            if (key.key == shortcut.key && key.control == shortcut.control && !(key.control && key.shift) &&
                mayRepeat)
                run(app, shortcut.action);
        }
    }
}

}  // namespace brume::preview
