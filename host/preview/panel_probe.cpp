// The pixel under the pointer, in a corner of the picture.
#include <imgui.h>

#include <algorithm>

#include "frame/color_encoding.hpp"
#include "preview/app.hpp"
#include "preview/probe.hpp"
#include "preview/theme.hpp"

namespace brume::preview {

static ImU32 seen(const cv::Vec4f& color) {
    int c[3];
    for (int k = 0; k < 3; k++)
        c[k] = int(255 * std::clamp(srgbEncode(std::max(0.f, color[k])), 0., 1.) + .5);
    return IM_COL32(c[0], c[1], c[2], 255);
}

void drawProbe(App& app) {
    if (!app.settings.probe || !app.probed || !app.loaded || app.look.isDraggingWipe) return;
    const Probe probe = probeAt(*app.loaded, app.rendered.get(), *app.probed);
    const auto lines = probeLines(probe);
    const float scale = float(app.window.contentScale());
    const float line = ImGui::GetTextLineHeight() + 3 * scale, padding = 12 * scale;
    const float labels = 108 * scale, width = 336 * scale, height = line * float(lines.size()) + 2 * padding;
    const cv::Rect2d area = app.look.view.area();
    const ImVec2 mouse = ImGui::GetIO().MousePos;
    const float margin = 14 * scale;
    ImVec2 at{float(area.x) + margin, float(area.y + area.height) - height - margin};
    if (mouse.x < at.x + width + 30 && mouse.y > at.y - 30)
        at.x = float(area.x + area.width) - width - margin;
    ImDrawList* list = ImGui::GetWindowDrawList();
    list->AddRectFilled(at, {at.x + width, at.y + height}, IM_COL32(16, 17, 19, 222), 6 * scale);
    ImVec2 pen{at.x + padding, at.y + padding};
    for (const auto& [label, value] : lines) {
        list->AddText(pen, ImGui::GetColorU32(colors::dim), label.c_str());
        list->AddText(monoFont(), monoFont()->FontSize, {pen.x + labels, pen.y}, IM_COL32(228, 229, 232, 255),
                      value.c_str());
        const bool isBefore = label == "before", isAfter = label == "after" && probe.after;
        if (isBefore || isAfter) {
            const float right = at.x + width - padding, side = line - 4 * scale;
            list->AddRectFilled({right - side, pen.y + 1}, {right, pen.y + 1 + side},
                                seen(isBefore ? probe.before : *probe.after), 2);
        }
        pen.y += line;
    }
}

}  // namespace brume::preview
