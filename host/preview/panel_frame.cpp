// What the reader understood of the frame, and what looks doubtful about it.
#include <imgui.h>

#include <cmath>
#include <filesystem>

#include "error.hpp"
#include "preview/app.hpp"
#include "preview/theme.hpp"

namespace brume::preview {

namespace {

void heading(const char* words) {
    ImGui::Dummy({0, 6});
    ImGui::PushFont(boldFont());
    ImGui::TextUnformatted(words);
    ImGui::PopFont();
}

std::string printed(const char* format, double a) {
    char words[64];
    std::snprintf(words, sizeof words, format, a);
    return words;
}

double degreesOf(int pixels, double focal) { return 2 * std::atan(pixels / 2. / focal) * 180 / M_PI; }

void drawFacts(App& app) {
    const LoadedFrame& loaded = *app.loaded;
    const FramePair& frame = loaded.frame;
    if (!ImGui::BeginTable("facts", 2)) return;
    ImGui::TableSetupColumn("label", ImGuiTableColumnFlags_WidthFixed, 84);
    ImGui::TableSetupColumn("fact", ImGuiTableColumnFlags_WidthStretch);
    for (const std::string& file : frame.files)
        labelledRow(roleOf(file, loaded.capture), std::filesystem::path(file).filename().string());
    labelledRow("size", text(frame.size().width, " × ", frame.size().height, " px"));
    const Camera& c = frame.camera;
    labelledRow("view", printed("%.1f°", degreesOf(frame.size().width, c.fx)) + " × " +
                            printed("%.1f°", degreesOf(frame.size().height, c.fy)) + ", eye " +
                            printed("%.2f m", c.eye()[1]) + " up" +
                            (loaded.capture.poseIsStated ? "" : " (pose assumed)"));
    labelledRow("depth", loaded.encoding.describe());
    if (app.inspection) {
        const DepthStatistics& s = app.inspection->statistics;
        labelledRow("range", printed("%.4g", s.least) + " to " + printed("%.4g m", s.greatest) + ", median " +
                                 printed("%.4g m", s.median));
        labelledRow("sky", printed("%.2f %%", s.sky * 100));
        labelledRow("unknown", printed("%.2f %%", s.unknown * 100));
    }
    if (frame.time != 0 || app.session.frames().size() > 1)
        labelledRow("time", printed("%.4g s", frame.time));
    ImGui::EndTable();
}

void drawReadings(App& app) {
    const Inspection& inspection = *app.inspection;
    if (inspection.readings.empty()) return;
    heading("What the depth's numbers could mean");
    ImGui::PushTextWrapPos();
    ImGui::TextColored(
        colors::dim,
        "Nothing states it. Likeliest first, by the geometry each would give; click one to read depth so.");
    ImGui::PopTextWrapPos();
    const float width = 168, gap = ImGui::GetStyle().ItemSpacing.x;
    const float whole = ImGui::GetContentRegionAvail().x;
    const int columns = std::max(1, int((whole + gap) / (width + gap + 8)));
    for (size_t k = 0; k < inspection.readings.size(); k++) {
        const Reading& reading = inspection.readings[k];
        ScreenTexture& texture = app.thumbnails[reading.name];
        texture.upload(app.window.gl(), inspection.thumbnails[k]);
        if (k % size_t(columns) != 0) ImGui::SameLine();
        ImGui::BeginGroup();
        const bool isChosen = app.loaded->encoding == reading.encoding;
        ImGui::PushStyleColor(ImGuiCol_Button, isChosen ? colors::accent : ImVec4(.2f, .2f, .21f, 1));
        ImGui::PushID(int(k));
        const cv::Size size = texture.size();
        if (ImGui::ImageButton(texture.id(), {float(size.width), float(size.height)}, {0, 0}, {1, 1}, 3))
            app.attempt([&] { app.session.readDepthAs(reading.name); });
        ImGui::PopID();
        ImGui::PopStyleColor();
        app.ui.mark("reading." + reading.name);
        if (ImGui::IsItemHovered())
            ImGui::SetTooltip("%s\n%s", reading.name.c_str(), reading.evidence.c_str());
        ImGui::PushTextWrapPos(ImGui::GetCursorPosX() + width);
        if (isChosen)
            ImGui::TextUnformatted(reading.name.c_str());
        else
            ImGui::TextColored(colors::quiet, "%s", reading.name.c_str());
        ImGui::PopTextWrapPos();
        ImGui::EndGroup();
    }
}

}  // namespace

void drawFramePanel(App& app) {
    ImGui::BeginChild("frame");
    if (!app.loaded) {
        ImGui::TextColored(colors::dim, "No frame yet. Drop one on the window.");
        ImGui::EndChild();
        return;
    }
    ImGui::PushFont(boldFont());
    ImGui::TextUnformatted(app.loaded->frame.name.c_str());
    ImGui::PopFont();
    drawFacts(app);
    heading("What the reader understood");
    for (const std::string& note : app.loaded->frame.notes) {
        ImGui::Bullet();
        wrappedText(note, ImGui::GetStyleColorVec4(ImGuiCol_Text));
    }
    if (!app.loaded->assumed.empty()) {
        ImGui::Bullet();
        ImGui::PushTextWrapPos();
        ImGui::TextColored(colors::warning, "depth is read as %s, the likeliest; nothing states it",
                           app.loaded->assumed.c_str());
        ImGui::PopTextWrapPos();
    }
    heading("Doubts");
    if (!app.inspection) {
        ImGui::TextColored(colors::dim, "looking…");
    } else {
        if (app.inspection->doubts.empty()) ImGui::TextColored(colors::dim, "Nothing looks wrong.");
        for (const Doubt& doubt : app.inspection->doubts) {
            ImGui::TextColored(colors::warning, "%s", doubt.name.c_str());
            wrappedText(doubt.evidence, ImGui::GetStyleColorVec4(ImGuiCol_Text));
        }
        drawReadings(app);
    }
    ImGui::EndChild();
}

}  // namespace brume::preview
