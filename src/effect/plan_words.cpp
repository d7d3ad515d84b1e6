#include "effect/plan_words.hpp"

#include <algorithm>
#include <cstdio>

#include "error.hpp"

namespace brume {

std::string choiceWords(const Chain& chain, const StepPlan& step) {
    if (!step.planned) return "as written";
    if (step.plan.skip) return "skipped";
    const auto found =
        std::find_if(chain.steps.begin(), chain.steps.end(), [&](const Step& s) { return s.id == step.id; });
    std::string words;
    for (const auto& [name, value] : step.plan.chosen) {
        std::string label = text(value);
        const Parameter* parameter =
            found == chain.steps.end() ? nullptr : findParameter(found->effect->header.parameters, name);
        for (size_t k = 0; parameter && k < parameter->labels.size(); k++)
            if (double(parameter->values[k]) == value) label = parameter->labels[k];
        words += text(words.empty() ? "" : "; ", name, " = ", label);
    }
    return words.empty() ? "as written" : words;
}

std::string predictionWords(const StepPlan& step) {
    if (!step.planned || step.tolerance == 0) return {};
    // Of a picture that is clipped; what later steps read may be judged above it.
    const double steps = std::min(255 * step.plan.predictedError, 255.);
    char line[160];
    std::snprintf(line, sizeof line, "off by %.*g%s (%.2g allowed), for the time of %.*f frame copies",
                  steps < 100 ? 2 : 3, steps, steps > 1 ? " 8-bit steps" : " of an 8-bit step",
                  255 * step.tolerance, step.plan.predictedCost < 10 ? 1 : 0, step.plan.predictedCost);
    return line;
}

}  // namespace brume
