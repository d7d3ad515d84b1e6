#include "preview/explain.hpp"

#include <algorithm>
#include <cstdio>

namespace brume::preview {

static std::string labelOf(const Step* step, const std::string& name, long value) {
    const Parameter* parameter = step ? findParameter(step->effect->header.parameters, name) : nullptr;
    for (size_t k = 0; parameter && k < parameter->values.size(); k++)
        if (parameter->values[k] == value && k < parameter->labels.size()) return parameter->labels[k];
    return std::to_string(value);
}

std::vector<Decision> decisionsOf(const Chain& chain, const std::vector<StepPlan>& plans) {
    std::vector<Decision> decisions;
    for (const StepPlan& plan : plans) {
        auto step = std::find_if(chain.steps.begin(), chain.steps.end(),
                                 [&](const Step& s) { return s.id == plan.id; });
        Decision decision;
        decision.id = plan.id;
        if (plan.planned) {
            if (plan.plan.skip) decision.chosen = "skipped";
            for (const auto& [name, value] : plan.plan.chosen)
                decision.chosen += (decision.chosen.empty() ? "" : ", ") + name + " = " +
                                   labelOf(step == chain.steps.end() ? nullptr : &*step, name, value);
            decision.why = plan.plan.why;
            if (!plan.plan.skip && plan.plan.predictedCost > 0) {
                char words[96];
                std::snprintf(words, sizeof words, "predicted: error %.2g, %.3g frame copies",
                              plan.plan.predictedError, plan.plan.predictedCost);
                decision.costs = words;
            }
        }
        decisions.push_back(decision);
    }
    return decisions;
}

}  // namespace brume::preview
