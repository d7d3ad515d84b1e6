// The part of `brume check` that looks at plans.
#pragma once

#include <string>
#include <vector>

#include "options.hpp"

namespace brume::host {

struct PlanArguments {
    bool isAsked = false, isTimed = false;
    std::vector<std::string> frames;
    FrameOptions frameOptions;
    std::string size = "160x90", csv;
    int first = 0, count = 60;
    double seconds = 0;  ///< 0: as long as it takes
};

void addPlanOptions(CLI::App& command, PlanArguments& arguments);

/// Prints distributions of errors and times. Throws Error (CheckFailed) where a measured error passes the
/// tolerance without the plan having said so.
void checkPlans(const PlanArguments& arguments, const std::vector<std::string>& effects, uint32_t seed,
                size_t pixels);

}  // namespace brume::host
