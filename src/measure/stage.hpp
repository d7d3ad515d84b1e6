// Where an effect is measured: on a frame, or on what CHART's BEFORE makes of it.
#pragma once

#include "effect/chain.hpp"
#include "frame/frame_pair.hpp"

namespace brume {

/// The frame that an effect gets: as captured, or what the steps of CHART's BEFORE made of it (on the CPU). A
/// blur that grows with fog, say, has nothing to do without fog. Copies share the captured pixels.
class Stage {
  public:
    /// Throws brume::Error where BEFORE is no preset or a step of it fails.
    Stage(const std::shared_ptr<const Effect>& effect, const FramePair& captured);

    const FramePair& frame() const { return frame_; }

    /// The chain with the image parameters of its steps reading what BEFORE left, as they would in one chain.
    Chain placed(Chain chain) const;

  private:
    FramePair frame_;
};

}  // namespace brume
