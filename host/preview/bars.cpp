// Below the picture: the sequence, and a line of words.
#include <imgui.h>

#include <cmath>
#include <cstdio>

#include "error.hpp"
#include "preview/app.hpp"
#include "preview/theme.hpp"

namespace brume::preview {

void drawTimeline(App& app) {
    const int count = int(app.session.frames().size());
    if (ImGui::Button(app.playing.isOn ? "Stop" : "Play", {ImGui::CalcTextSize("Stop").x + 20, 0}))
        app.togglePlay();
    app.ui.mark("play");
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("Space");
    ImGui::SameLine();
    const float right = 250 * float(app.window.contentScale());
    ImGui::SetNextItemWidth(std::max(80.f, ImGui::GetContentRegionAvail().x - right));
    int frame = int(app.session.current()) + 1;
    const std::string format = "%d of " + std::to_string(count);
    if (ImGui::SliderInt("##frame", &frame, 1, count, format.c_str(), ImGuiSliderFlags_AlwaysClamp))
        app.goTo(size_t(frame - 1));
    app.ui.mark("timeline");
    ImGui::SameLine();
    ImGui::Checkbox("loop", &app.settings.loop);
    ImGui::SameLine();
    ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x);
    const double least = .1, most = 240;
    ImGui::DragScalar("##rate", ImGuiDataType_Double, &app.playing.framesPerSecond, .1f, &least, &most,
                      "%.4g frames/s", ImGuiSliderFlags_AlwaysClamp);
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("How fast it plays; every frame is shown, however slow");
}

void drawStatus(App& app) {
    std::string facts;
    char words[96];
    if (app.rendered) {
        if (app.isBusy() || !app.rendered->isFinal)
            facts += app.rendered->scale > 1 ? "refining…   " : "working…   ";
        std::snprintf(words, sizeof words, "%.1f ms", app.rendered->runMilliseconds);
        facts += words;
        if (app.playing.isOn) {
            std::snprintf(words, sizeof words, "   %.1f frames/s", app.frameRate);
            facts += words;
        }
    }
    if (app.loaded)
        facts += text("   ", app.loaded->frame.size().width, " × ", app.loaded->frame.size().height);
    const float width = ImGui::CalcTextSize(facts.c_str()).x;
    const float whole = ImGui::GetContentRegionAvail().x;
    ImGui::AlignTextToFramePadding();
    const Message& message = app.session.message();
    const ImVec2 at = ImGui::GetCursorScreenPos();
    ImGui::PushClipRect(at, {at.x + whole - width - 20, at.y + ImGui::GetFrameHeight()}, true);
    ImGui::TextColored(message.isError ? colors::error : colors::quiet, "%s", message.text.c_str());
    ImGui::PopClipRect();
    if (ImGui::IsItemHovered() && ImGui::CalcTextSize(message.text.c_str()).x > whole - width - 20)
        ImGui::SetTooltip("%s", message.text.c_str());
    ImGui::SameLine(ImGui::GetStyle().WindowPadding.x + whole - width);
    ImGui::TextColored(colors::dim, "%s", facts.c_str());
}

}  // namespace brume::preview
