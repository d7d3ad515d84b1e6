// Fonts and colours of the window, and the rows of its tables.
#pragma once

#include <imgui.h>

#include <string>

namespace brume::preview {

/// `scale`: of the screen, 1 for an ordinary one. After ImGui::CreateContext, before the first frame.
void applyTheme(double scale);

ImFont* boldFont();
ImFont* monoFont();

namespace colors {
inline const ImVec4 dim{.58f, .60f, .63f, 1};
inline const ImVec4 faint{.38f, .40f, .42f, 1};  ///< what can change nothing now
inline const ImVec4 quiet{.74f, .75f, .78f, 1};  ///< a label of what is as it was by default
inline const ImVec4 chosen{.23f, .42f, .57f, 1};
inline const ImVec4 accent{.36f, .62f, .80f, 1};
inline const ImVec4 warning{.93f, .72f, .38f, 1};
inline const ImVec4 error{.95f, .48f, .42f, 1};
}  // namespace colors

/// Words broken at spaces only, where ImGui would also break "1.5" after its point.
void wrappedText(const std::string& words, const ImVec4& color);

/// A row of a table of two columns: a dim label and words that wrap.
void labelledRow(const char* label, const std::string& words);

}  // namespace brume::preview
