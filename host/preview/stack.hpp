// Edits of a chain: what the stack of effects offers. Each leaves a chain whose ids differ.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "effect/chain.hpp"

namespace brume::preview {

/// A step of that effect with its defaults; other images than the main one read "captured".
Step newStep(const std::shared_ptr<const Effect>& effect);
/// Puts the step at `place`, with an id that no other has.
void insertStep(Chain& chain, size_t place, Step step);
void duplicateStep(Chain& chain, size_t place);
/// Takes the step at `from` out and puts it where it then stands at `to`.
void moveStep(Chain& chain, size_t from, size_t to);

/// Images that the step at `place` may read: color, captured, transmittance, and what earlier steps write.
std::vector<std::string> imagesBefore(const Chain& chain, size_t place);
/// Images that can be looked at after the whole chain, besides color and captured.
std::vector<std::string> namedImages(const Chain& chain);

/// A label as the window writes it: "max_opacity" as "Max opacity"; an axis ("x density") stays small.
std::string titleOf(std::string label);

/// Steps of an effect with the same file run `effect` from now on; values of parameters that it still has in
/// the same form stay.
void replaceEffect(Chain& chain, const std::shared_ptr<const Effect>& effect);

}  // namespace brume::preview
