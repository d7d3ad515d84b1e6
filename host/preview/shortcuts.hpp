// Every key of the window, in one table: what acts, what the help panel shows, what docs/PREVIEW.md lists.
#pragma once

#include <vector>

namespace brume::preview {

/// An action by name; the window knows what each does.
enum class Action {
    Result,
    Before,
    Wipe,
    Blink,
    Depth,
    Difference,
    NextImage,
    Probe,
    Fit,
    OneToOne,
    ZoomIn,
    ZoomOut,
    Undo,
    Redo,
    SavePreset,
    SaveImage,
    Open,
    CopyApply,
    AddEffect,
    NextFrame,
    PreviousFrame,
    FirstFrame,
    LastFrame,
    Play,
    Backend,
    Effects,
    Frame,
    Timing,
    Screenshot,
    Help,
    Quit
};

struct Shortcut {
    Action action;
    int key;  ///< GLFW's
    bool control;
    const char* keys;  ///< as people read it
    const char* what;
    bool repeats = false;  ///< goes on while the key is held
};

const std::vector<Shortcut>& shortcuts();

/// What the mouse does, for the help panel: pairs of gesture and effect.
const std::vector<std::pair<const char*, const char*>>& gestures();

}  // namespace brume::preview
