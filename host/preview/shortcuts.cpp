#include "preview/shortcuts.hpp"

#include <GLFW/glfw3.h>

#include <utility>

namespace brume::preview {

const std::vector<Shortcut>& shortcuts() {
    static const std::vector<Shortcut> all = {
        {Action::Result, GLFW_KEY_R, false, "R", "Result"},
        {Action::Before, GLFW_KEY_B, false, "B", "Before: the frame as captured"},
        {Action::Wipe, GLFW_KEY_W, false, "W", "Wipe: before on the left of a line that you drag"},
        {Action::Blink, GLFW_KEY_K, false, "K", "Blink between before and result"},
        {Action::Depth, GLFW_KEY_D, false, "D", "Depth in log colours: near pale, far dark"},
        {Action::Difference, GLFW_KEY_X, false, "X", "Difference of GLSL and CPU as a heat map"},
        {Action::NextImage, GLFW_KEY_I, false, "I",
         "The next named image: transmittance, what effects write"},
        {Action::Probe, GLFW_KEY_P, false, "P", "Pixel probe on or off"},
        {Action::Fit, GLFW_KEY_F, false, "F", "Fit the picture into the window"},
        {Action::OneToOne, GLFW_KEY_1, false, "1", "One pixel for one"},
        {Action::ZoomIn, GLFW_KEY_EQUAL, false, "+", "Zoom in", true},
        {Action::ZoomOut, GLFW_KEY_MINUS, false, "-", "Zoom out", true},
        {Action::PreviousFrame, GLFW_KEY_LEFT, false, "←", "Previous frame", true},
        {Action::NextFrame, GLFW_KEY_RIGHT, false, "→", "Next frame", true},
        {Action::FirstFrame, GLFW_KEY_HOME, false, "Home", "First frame"},
        {Action::LastFrame, GLFW_KEY_END, false, "End", "Last frame"},
        {Action::Play, GLFW_KEY_SPACE, false, "Space", "Play or stop"},
        {Action::Undo, GLFW_KEY_Z, true, "Ctrl+Z", "Undo", true},
        {Action::Redo, GLFW_KEY_Y, true, "Ctrl+Y", "Do again", true},
        {Action::AddEffect, GLFW_KEY_A, false, "A", "Add an effect"},
        {Action::SavePreset, GLFW_KEY_S, true, "Ctrl+S", "Save the preset"},
        {Action::SaveImage, GLFW_KEY_E, true, "Ctrl+E", "Save the image at full size"},
        {Action::CopyApply, GLFW_KEY_L, true, "Ctrl+L", "Copy the equivalent brume apply line"},
        {Action::Open, GLFW_KEY_O, true, "Ctrl+O", "Open a preset, effect or frames by path"},
        {Action::Backend, GLFW_KEY_G, false, "G", "Change between GLSL and CPU"},
        {Action::Effects, GLFW_KEY_F2, false, "F2", "Effects"},
        {Action::Frame, GLFW_KEY_F3, false, "F3", "Frame: what was understood, and doubts"},
        {Action::Timing, GLFW_KEY_F4, false, "F4", "Timing and plan"},
        {Action::Screenshot, GLFW_KEY_F12, false, "F12", "Save a picture of the window"},
        {Action::Help, GLFW_KEY_F1, false, "F1", "This help"},
        {Action::Quit, GLFW_KEY_Q, true, "Ctrl+Q", "Close the window"},
    };
    return all;
}

const std::vector<std::pair<const char*, const char*>>& gestures() {
    static const std::vector<std::pair<const char*, const char*>> all = {
        {"Wheel", "Zoom, keeping the point under the pointer"},
        {"Drag", "Move the picture; the wipe's line moves the wipe"},
        {"Double click", "Fit, or one pixel for one"},
        {"Ctrl+click on a slider", "Type an exact value, also beyond the slider's ends"},
        {"Drag an effect's name", "Change the order"},
        {"Drop files on the window", "Open frames, a preset (.json) or an effect (.fs)"},
    };
    return all;
}

}  // namespace brume::preview
