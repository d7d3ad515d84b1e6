// What the plan decided and why, for people.
#pragma once

#include <string>
#include <vector>

#include "effect/chain.hpp"

namespace brume::preview {

struct Decision {
    std::string id;
    std::string chosen;  ///< "method = box, steps = 12"; "skipped"; empty: as written
    std::string why;     ///< one sentence, or empty
    std::string costs;   ///< what it predicted: "error .0004, 3.1 frame copies"; empty: nothing
};

/// One for each step that is switched on.
std::vector<Decision> decisionsOf(const Chain& chain, const std::vector<StepPlan>& plans);

}  // namespace brume::preview
