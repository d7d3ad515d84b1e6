// What panels, keys and popups ask of the window.
#include <imgui.h>

#include <filesystem>

#include "error.hpp"
#include "frame/image_writers.hpp"
#include "frame/pending_file.hpp"
#include "frame/write.hpp"
#include "preview/app.hpp"

namespace brume::preview {

void App::show(Show what, const std::string& image) {
    look.show = what;
    if (!image.empty()) look.image = image;
}

void App::goTo(size_t frame) {
    playing.isOn = false;
    session.goTo(frame);
}

void App::togglePlay() {
    if (session.frames().size() < 2) return session.say("There is only one frame to play");
    playing.isOn = !playing.isOn;
    playing.next = Clock::now();
    if (playing.isOn && session.current() + 1 == session.frames().size()) session.goTo(0);
}

void App::copyApplyLine() {
    attempt([&] {
        const std::string line = applyLine(session, backend);
        ImGui::SetClipboardText(line.c_str());
        session.say("Copied: " + line);
    });
}

void App::saveImage(const std::string& path) {
    attempt([&] {
        if (!loaded) failUsage("Open a frame first");
        const bool isWhole = rendered && rendered->isFinal && rendered->scale == 1 &&
                             rendered->job.revision == session.revision();
        if (!isWhole) failUsage("The picture is not finished yet; save it when the status line says so");
        const bool isNamed = look.show == Show::Image;
        auto found = rendered->images.find(isNamed ? look.image : "color");
        if (found == rendered->images.end()) failUsage("There is no image '", look.image, "' to save");
        requireWritableEnding(path);
        WriteOptions how;
        how.frameIndex = loaded->frame.index;
        how.seed = loaded->frame.seed;
        how.isData = isNamed;
        writeImage(path, found->second, how);
        session.say(text("Saved ", path, ", ", found->second.cols, " × ", found->second.rows));
    });
}

void App::writeScreenshot(const std::string& path) {
    PendingFile pending(path);
    const std::filesystem::path ending = std::filesystem::path(path).extension();
    if (ending == ".jpg" || ending == ".jpeg")
        writeThroughOpenImageIo(pending.path(), window.readPixels(), true, {});
    else
        writePng(pending.path(), window.readPixels(), {});
    pending.commit();
}

void App::saveScreenshot(const std::string& path) {
    attempt([&] {
        writeScreenshot(path);
        session.say("Saved " + path);
    });
}

}  // namespace brume::preview
