// The fp64 truth of a chain at chosen pixels.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "effect/chain.hpp"

namespace brume {

/// Every step replaced by its effect's reference, in order, over `frame` (depth without NaN; `frame.images`
/// may hold further named images that steps read). Between steps images are rounded to fp32; a step is asked
/// at the given pixels only where all that follow are POINTWISE, else at every pixel of its output. Pixels
/// are those of the size that the image "color" has in the end. `color` is the image, `transmittance` the
/// running product (1 where nobody reads it and no effect writes it); `scale`, `allowance` and `methodError`
/// are the last step's; `ambiguous` is any step's.
///
/// Deterministic; shares the pixels among OpenCV's threads. Throws Error (CheckFailed) where an effect has no
/// reference, or where the chain names an image that does not exist.
std::vector<ReferencePixel> referenceOfChain(const Chain& chain, const FramePair& frame,
                                             std::span<const cv::Point> pixels);

/// The size of the image "color" after the chain's last step.
cv::Size outputSizeOfChain(const Chain& chain, const FramePair& frame);

/// True where every enabled step has a reference.
bool hasReference(const Chain& chain);

}  // namespace brume
