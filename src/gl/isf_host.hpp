// What foreign ISF files expect of their host: names, functions, uniforms, stand-ins for what brume does not
// have.
#pragma once

#include <opencv2/core/mat.hpp>

#include "effect/effect.hpp"
#include "effect/kit/view.hpp"
#include "gl/isf_rewrite.hpp"
#include "gl/program.hpp"

namespace brume {

/// Per pass: RENDERSIZE, TIMEDELTA, DATE (midnight of 1 January 2000 plus TIME, so that the same frame gives
/// the same picture).
void isfSetUniforms(const Program& program, const View& view, double timeDelta, cv::Size target);

/// Silence, as images: a waveform at rest (audio), a spectrum of nothing (audioFFT).
cv::Size isfAudioSize(const Parameter& parameter);
cv::Vec4f isfSilence(const Parameter& parameter);

/// RGBA (CV_32FC4) as stored, not decoded. Throws Error (Io).
cv::Mat isfImportedImage(const ImportedImage& image);

/// True where its shaders may leave pixels undrawn: they discard, or a vertex shader moves the quad.
bool isfMayLeavePixels(const Effect& effect);

}  // namespace brume
