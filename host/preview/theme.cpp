#include "preview/theme.hpp"

#include <filesystem>
#include <sstream>
#include <string>

#include "file_status.hpp"

namespace brume::preview {

static ImFont *bold = nullptr, *mono = nullptr;

ImFont* boldFont() { return bold; }
ImFont* monoFont() { return mono; }

// DejaVu where Debian, Fedora and Arch put it; ImGui's own bitmap font otherwise.
static ImFont* load(const char* file, float size) {
    static const ImWchar glyphs[] = {0x20,   0x24f,  0x370,  0x3ff,  0x2000, 0x206f, 0x2070,
                                     0x209f, 0x2190, 0x21ff, 0x2200, 0x22ff, 0x2300, 0x23ff,
                                     0x25a0, 0x25ff, 0x2600, 0x26ff, 0x2700, 0x27bf, 0};
    for (const char* folder : {"/usr/share/fonts/truetype/dejavu/", "/usr/share/fonts/dejavu-sans-fonts/",
                               "/usr/share/fonts/TTF/", "/usr/share/fonts/dejavu/"}) {
        const std::string path = std::string(folder) + file;
        if (isThere(path))
            return ImGui::GetIO().Fonts->AddFontFromFileTTF(path.c_str(), size, nullptr, glyphs);
    }
    return nullptr;
}

void applyTheme(double scale) {
    const float size = float(14.5 * scale);
    auto* fonts = ImGui::GetIO().Fonts;
    ImFont* regular = load("DejaVuSans.ttf", size);
    if (!regular) regular = fonts->AddFontDefault();
    bold = load("DejaVuSans-Bold.ttf", size);
    mono = load("DejaVuSansMono.ttf", float(13.5 * scale));
    if (!bold) bold = regular;
    if (!mono) mono = regular;

    ImGuiStyle& s = ImGui::GetStyle();
    ImGui::StyleColorsDark(&s);
    s.WindowPadding = {10, 8};
    s.FramePadding = {7, 4};
    s.ItemSpacing = {7, 6};
    s.ItemInnerSpacing = {6, 4};
    s.CellPadding = {4, 3};
    s.IndentSpacing = 14;
    s.ScrollbarSize = 11;
    s.GrabMinSize = 9;
    s.WindowBorderSize = 0;
    s.PopupBorderSize = 1;
    s.FrameRounding = s.GrabRounding = s.TabRounding = 4;
    s.PopupRounding = 6;
    s.WindowRounding = 0;
    s.ScrollbarRounding = 6;
    s.ScaleAllSizes(float(scale));

    auto grey = [](float v, float alpha = 1) { return ImVec4(v, v + .004f, v + .012f, alpha); };
    auto blue = [](float alpha) { return ImVec4(.26f, .50f, .68f, alpha); };
    ImVec4* c = s.Colors;
    c[ImGuiCol_Text] = grey(.88f);
    c[ImGuiCol_TextDisabled] = colors::dim;
    c[ImGuiCol_WindowBg] = grey(.135f);
    c[ImGuiCol_ChildBg] = grey(.135f, 0);
    c[ImGuiCol_PopupBg] = grey(.165f);
    c[ImGuiCol_TitleBg] = c[ImGuiCol_TitleBgActive] = grey(.19f);
    c[ImGuiCol_Border] = grey(.27f);
    c[ImGuiCol_FrameBg] = grey(.205f);
    c[ImGuiCol_FrameBgHovered] = grey(.25f);
    c[ImGuiCol_FrameBgActive] = grey(.28f);
    c[ImGuiCol_Button] = grey(.22f);
    c[ImGuiCol_ButtonHovered] = grey(.29f);
    c[ImGuiCol_ButtonActive] = blue(.9f);
    c[ImGuiCol_Header] = grey(.20f);
    c[ImGuiCol_HeaderHovered] = grey(.25f);
    c[ImGuiCol_HeaderActive] = grey(.28f);
    c[ImGuiCol_SliderGrab] = ImVec4(.42f, .66f, .84f, 1);
    c[ImGuiCol_SliderGrabActive] = ImVec4(.55f, .78f, .95f, 1);
    c[ImGuiCol_CheckMark] = ImVec4(.50f, .74f, .92f, 1);
    c[ImGuiCol_Tab] = grey(.135f);
    c[ImGuiCol_TabHovered] = grey(.26f);
    c[ImGuiCol_TabActive] = grey(.23f);
    c[ImGuiCol_TabUnfocused] = c[ImGuiCol_Tab];
    c[ImGuiCol_TabUnfocusedActive] = c[ImGuiCol_TabActive];
    c[ImGuiCol_Separator] = grey(.24f);
    c[ImGuiCol_SeparatorHovered] = blue(.7f);
    c[ImGuiCol_SeparatorActive] = blue(1);
    c[ImGuiCol_ScrollbarBg] = grey(.135f, 0);
    c[ImGuiCol_ScrollbarGrab] = grey(.28f);
    c[ImGuiCol_TableHeaderBg] = grey(.17f);
    c[ImGuiCol_TableBorderLight] = grey(.21f);
    c[ImGuiCol_TableBorderStrong] = grey(.25f);
    c[ImGuiCol_TextSelectedBg] = blue(.55f);
    c[ImGuiCol_DragDropTarget] = colors::accent;
    c[ImGuiCol_NavHighlight] = blue(.8f);
    c[ImGuiCol_ModalWindowDimBg] = ImVec4(.05f, .05f, .06f, .55f);
}

void wrappedText(const std::string& words, const ImVec4& color) {
    const float width = ImGui::GetContentRegionAvail().x - 1;
    std::string broken, line, word;
    std::istringstream rest(words);
    while (rest >> word) {
        const std::string longer = line.empty() ? word : line + ' ' + word;
        if (!line.empty() && ImGui::CalcTextSize(longer.c_str()).x > width) {
            broken += line + '\n';
            line = word;
        } else {
            line = longer;
        }
    }
    broken += line;
    ImGui::PushTextWrapPos();  // for a word that is longer than a line
    ImGui::TextColored(color, "%s", broken.c_str());
    ImGui::PopTextWrapPos();
}

void labelledRow(const char* label, const std::string& words) {
    ImGui::TableNextRow();
    ImGui::TableNextColumn();
    ImGui::TextColored(colors::dim, "%s", label);
    ImGui::TableNextColumn();
    wrappedText(words, ImGui::GetStyleColorVec4(ImGuiCol_Text));
}

}  // namespace brume::preview
