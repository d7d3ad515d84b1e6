// The picture: drawn, zoomed, moved, wiped.
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "error.hpp"
#include "preview/app.hpp"
#include "preview/theme.hpp"

namespace brume::preview {

namespace {

ImVec2 toIm(cv::Point2d p) { return {float(p.x), float(p.y)}; }

void label(ImDrawList* list, ImVec2 at, const char* words) {
    const ImVec2 size = ImGui::CalcTextSize(words);
    list->AddRectFilled({at.x - 6, at.y - 3}, {at.x + size.x + 6, at.y + size.y + 3},
                        IM_COL32(16, 17, 19, 190), 4);
    list->AddText(at, IM_COL32(225, 226, 230, 255), words);
}

// A part of the picture, from u0 to u1 of its width.
void drawPart(App& app, ImDrawList* list, ScreenTexture& texture, double u0, double u1) {
    if (texture.isEmpty() || u1 <= u0) return;
    const PictureView& view = app.look.view;
    const double shrink = view.zoom() * view.picture().width / texture.size().width;
    texture.setSampling(shrink >= 2, shrink < .7);
    const cv::Point2d a = view.toWindow({u0 * view.picture().width, 0});
    const cv::Point2d b = view.toWindow({u1 * view.picture().width, double(view.picture().height)});
    list->AddImage(texture.id(), toIm(a), toIm(b), {float(u0), 0}, {float(u1), 1});
}

void handleMouse(App& app, bool isHovered) {
    const ImGuiIO& io = ImGui::GetIO();
    PictureView& view = app.look.view;
    const cv::Point2d mouse(io.MousePos.x, io.MousePos.y);
    const cv::Point2d line = view.toWindow({app.look.wipe * view.picture().width, 0});
    const bool isNearLine = app.look.show == Show::Wipe && isHovered &&
                            std::abs(mouse.x - line.x) < 9 * app.window.contentScale();
    if (isNearLine || app.look.isDraggingWipe) ImGui::SetMouseCursor(ImGuiMouseCursor_ResizeEW);
    if (isHovered && io.MouseWheel != 0) view.zoomBy(std::pow(1.2, io.MouseWheel), mouse);
    if (ImGui::IsItemActivated()) app.look.isDraggingWipe = isNearLine;
    if (ImGui::IsItemActive()) {
        if (app.look.isDraggingWipe)
            app.look.wipe = std::clamp(view.toPicture(mouse).x / view.picture().width, 0., 1.);
        else if (io.MouseDelta.x != 0 || io.MouseDelta.y != 0)
            view.pan({io.MouseDelta.x, io.MouseDelta.y});
    } else {
        app.look.isDraggingWipe = false;
    }
    if (isHovered && ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left) && !isNearLine) {
        if (view.isFit())
            view.zoomTo(1, mouse);
        else
            view.fit();
    }
}

std::string rounded(double number) {
    char words[32];
    std::snprintf(words, sizeof words, "%.2g", number);
    return words;
}

void drawHeatLegend(App& app, ImDrawList* list, ImVec2 at) {
    const auto& difference = app.rendered->difference;
    if (!difference) return;
    const float width = 230, height = 12;
    list->AddRectFilled({at.x - 10, at.y - 30}, {at.x + width + 10, at.y + height + 26},
                        IM_COL32(16, 17, 19, 215), 5);
    const std::string words =
        text("largest ", rounded(difference->largest), ", mean ", rounded(difference->mean),
             difference->unlike ? text(", ", difference->unlike, " px not numbers in one") : std::string());
    list->AddText({at.x, at.y - 24}, IM_COL32(225, 226, 230, 255), words.c_str());
    for (int k = 0; k < 46; k++) {
        const cv::Vec3b c = heatColor((k + .5) / 46);
        list->AddRectFilled({at.x + width * float(k) / 46, at.y},
                            {at.x + width * float(k + 1) / 46 + 1, at.y + height},
                            IM_COL32(c[0], c[1], c[2], 255));
    }
    for (int decade = -8; decade <= -2; decade++) {
        const std::string number = text("1e", decade);
        list->AddText({at.x + (width - 26) * float(decade + 8) / 6, at.y + height + 4},
                      IM_COL32(170, 172, 178, 255), number.c_str());
    }
}

}  // namespace

void drawPicture(App& app) {
    ImDrawList* list = ImGui::GetWindowDrawList();
    const ImVec2 corner = ImGui::GetWindowPos(), size = ImGui::GetWindowSize();
    list->AddRectFilled(corner, {corner.x + size.x, corner.y + size.y}, IM_COL32(20, 20, 22, 255));
    PictureView& view = app.look.view;
    const cv::Size picture = app.loaded ? app.loaded->frame.size() : cv::Size(16, 9);
    view.place({corner.x, corner.y, size.x, size.y}, picture);
    ImGui::InvisibleButton("picture", size);
    app.ui.mark("picture", view.area());
    const bool isHovered = ImGui::IsItemHovered();
    handleMouse(app, isHovered);

    app.probed.reset();
    if (app.loaded && isHovered) {
        const cv::Point2d at = view.toPicture({ImGui::GetIO().MousePos.x, ImGui::GetIO().MousePos.y});
        const cv::Point pixel(int(std::floor(at.x)), int(std::floor(at.y)));
        if (cv::Rect({0, 0}, picture).contains(pixel)) app.probed = pixel;
    }
    if (!app.loaded || !app.rendered) {
        const char* words = app.session.frames().empty() ? "Drop a frame here, or press Ctrl+O" : "Reading…";
        const ImVec2 extent = ImGui::CalcTextSize(words);
        list->AddText({corner.x + (size.x - extent.x) / 2, corner.y + (size.y - extent.y) / 2},
                      ImGui::GetColorU32(colors::dim), words);
        return;
    }
    const Show show = app.look.show;
    const bool isBlinkedBefore = show == Show::Blink && std::fmod(ImGui::GetTime(), 1.2) < .6;
    const bool hasBefore = !app.before.isEmpty();
    if ((show == Show::Before || isBlinkedBefore) && hasBefore) {
        drawPart(app, list, app.before, 0, 1);
    } else if (show == Show::Wipe && hasBefore) {
        drawPart(app, list, app.before, 0, app.look.wipe);
        drawPart(app, list, app.after, app.look.wipe, 1);
        const float x = float(view.toWindow({app.look.wipe * picture.width, 0}).x);
        const float top = std::max(corner.y, float(view.toWindow({0, 0}).y));
        const float bottom = std::min(corner.y + size.y, float(view.toWindow({0, double(picture.height)}).y));
        list->AddLine({x, top}, {x, bottom}, IM_COL32(0, 0, 0, 120), 3);
        list->AddLine({x, top}, {x, bottom}, IM_COL32(245, 245, 245, 230), 1.4f);
        const float middle = (top + bottom) / 2;
        list->AddCircleFilled({x, middle}, 8, IM_COL32(245, 245, 245, 235));
        list->AddTriangleFilled({x - 5, middle}, {x - 2, middle - 3}, {x - 2, middle + 3},
                                IM_COL32(40, 42, 46, 255));
        list->AddTriangleFilled({x + 5, middle}, {x + 2, middle - 3}, {x + 2, middle + 3},
                                IM_COL32(40, 42, 46, 255));
        app.ui.mark("wipe", {x - 2., middle - 2., 4, 4});
    } else {
        drawPart(app, list, app.after, 0, 1);
    }
    const ImVec2 note{corner.x + 14, corner.y + 12};
    if (show == Show::Blink || show == Show::Before)
        label(list, note, show == Show::Before || isBlinkedBefore ? "before" : "result");
    if (show == Show::Image) label(list, note, app.look.image.c_str());
    if (show == Show::Difference) drawHeatLegend(app, list, {corner.x + 22, corner.y + size.y - 50});
    if (app.rendered->scale > 1)
        label(list, {corner.x + size.x - 70, corner.y + 12}, text("1/", app.rendered->scale).c_str());
    drawProbe(app);
    const std::string& error = app.session.fileError().empty() ? app.renderError : app.session.fileError();
    if (error.empty()) return;
    // Over the last good picture, so that it is seen where one looks.
    const float width = std::min(size.x - 40, 900.f);
    const ImVec2 extent = ImGui::CalcTextSize(error.c_str(), nullptr, false, width - 28);
    const ImVec2 at{corner.x + 20, corner.y + size.y - extent.y - 40};
    list->AddRectFilled(at, {at.x + extent.x + 28, at.y + extent.y + 20}, IM_COL32(38, 18, 18, 235), 6);
    list->AddRect(at, {at.x + extent.x + 28, at.y + extent.y + 20}, IM_COL32(190, 80, 70, 255), 6);
    list->AddText(nullptr, 0, {at.x + 14, at.y + 10}, IM_COL32(250, 215, 208, 255), error.c_str(), nullptr,
                  width - 28);
}

}  // namespace brume::preview
