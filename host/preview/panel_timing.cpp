// What the picture costs, and what the plan decided.
#include <imgui.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <fstream>

#include "effect/plan_words.hpp"
#include "error.hpp"
#include "preview/app.hpp"
#include "preview/theme.hpp"

namespace brume::preview {

namespace {

std::string milliseconds(double ms) {
    char words[32];
    std::snprintf(words, sizeof words, ms < 10 ? "%.2f ms" : "%.1f ms", ms);
    return words;
}

double residentMegabytes() {
    std::ifstream in("/proc/self/statm");
    double whole = 0, resident = 0;
    in >> whole >> resident;
    return resident * double(sysconf(_SC_PAGESIZE)) / (1 << 20);
}

void drawOverview(App& app) {
    const Rendered& r = *app.rendered;
    if (!ImGui::BeginTable("overview", 2)) return;
    ImGui::TableSetupColumn("label", ImGuiTableColumnFlags_WidthFixed, 108);
    ImGui::TableSetupColumn("value", ImGuiTableColumnFlags_WidthStretch);
    labelledRow("run by", r.runner);
    labelledRow("chain", milliseconds(r.runMilliseconds) + " wall, plan and read-back included" +
                             (r.scale > 1 ? text(", at 1/", r.scale, " size") : std::string()));
    labelledRow("to 8 bits", milliseconds(r.showMilliseconds));
    if (app.frameRate > 0)
        labelledRow("pictures", text(float(std::round(app.frameRate * 10) / 10), " a second lately"));
    if (app.lastLatency > 0) labelledRow("slider to picture", milliseconds(app.lastLatency));
    double images = 0;
    for (const auto& [name, image] : r.images) images += double(image.total() * image.elemSize()) / (1 << 20);
    char words[96];
    std::snprintf(words, sizeof words, "%.0f MB in all, %.0f MB of them results", residentMegabytes(),
                  images);
    labelledRow("memory", words);
    ImGui::EndTable();
}

void drawPasses(App& app) {
    const Rendered& r = *app.rendered;
    ImGui::Dummy({0, 6});
    ImGui::PushFont(boldFont());
    ImGui::TextUnformatted(r.job.backend == "cpu" ? "Effects, wall time"
                                                  : "Effects and passes, GPU timer queries");
    ImGui::PopFont();
    double most = 1e-9, sum = 0;
    for (const StepTiming& t : r.timings) most = std::max(most, t.milliseconds), sum += t.milliseconds;
    if (!ImGui::BeginTable("passes", 3)) return;
    ImGui::TableSetupColumn("name", ImGuiTableColumnFlags_WidthStretch);
    ImGui::TableSetupColumn("bar", ImGuiTableColumnFlags_WidthFixed, 110);
    ImGui::TableSetupColumn("ms", ImGuiTableColumnFlags_WidthFixed, 70);
    auto line = [&](const std::string& name, double ms, bool hasBar) {
        ImGui::TableNextRow();
        ImGui::TableNextColumn();
        ImGui::TextUnformatted(name.c_str());
        ImGui::TableNextColumn();
        if (hasBar) {
            const ImVec2 at = ImGui::GetCursorScreenPos();
            const float height = ImGui::GetTextLineHeight();
            ImGui::GetWindowDrawList()->AddRectFilled(
                {at.x, at.y + 3}, {at.x + std::max(1.f, 110 * float(ms / most)), at.y + height - 2},
                ImGui::GetColorU32(colors::chosen), 2);
        }
        ImGui::TableNextColumn();
        const std::string words = milliseconds(ms);
        ImGui::SetCursorPosX(ImGui::GetCursorPosX() + ImGui::GetContentRegionAvail().x -
                             ImGui::CalcTextSize(words.c_str()).x);
        ImGui::TextUnformatted(words.c_str());
    };
    for (const StepTiming& t : r.timings) line(t.name, t.milliseconds, true);
    if (r.timings.size() > 1) line("together", sum, false);
    ImGui::EndTable();
    if (r.timings.empty()) ImGui::TextColored(colors::dim, "nothing ran");
}

void drawPlan(App& app) {
    ImGui::Dummy({0, 6});
    ImGui::PushFont(boldFont());
    ImGui::TextUnformatted("The plan");
    ImGui::PopFont();
    for (const StepPlan& step : app.rendered->decisions) {
        const std::string prediction = predictionWords(step);
        ImGui::Dummy({0, 1});
        ImGui::TextUnformatted(step.id.c_str());
        ImGui::SameLine();
        ImGui::TextColored(step.planned ? colors::accent : colors::dim, "%s",
                           choiceWords(app.rendered->job.chain, step).c_str());
        if (!step.plan.why.empty()) wrappedText(step.plan.why, colors::quiet);
        if (!prediction.empty()) wrappedText(prediction, colors::dim);
    }
}

}  // namespace

void drawTiming(App& app) {
    ImGui::BeginChild("timing");
    if (app.rendered) {
        drawOverview(app);
        drawPasses(app);
        drawPlan(app);
    } else {
        ImGui::TextColored(colors::dim, "No picture yet.");
    }
    ImGui::EndChild();
}

}  // namespace brume::preview
