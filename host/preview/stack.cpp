#include "preview/stack.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "error.hpp"

namespace brume::preview {

std::string titleOf(std::string label) {
    std::replace(label.begin(), label.end(), '_', ' ');
    const bool isAxis = label.size() > 1 && label[1] == ' ';
    if (!label.empty() && !isAxis && label[0] >= 'a' && label[0] <= 'z')
        label[0] = char(label[0] - 'a' + 'A');
    return label;
}

Step newStep(const std::shared_ptr<const Effect>& effect) {
    Step step;
    step.effect = effect;
    step.id = effect->name();
    step.values = defaultValues(effect->header.parameters);
    return step;
}

void insertStep(Chain& chain, size_t place, Step step) {
    const std::string base = step.effect->name();
    auto isTaken = [&](const std::string& id) {
        return std::any_of(chain.steps.begin(), chain.steps.end(), [&](const Step& s) { return s.id == id; });
    };
    for (int k = 2; isTaken(step.id); k++) step.id = base + std::to_string(k);
    place = std::min(place, chain.steps.size());
    chain.steps.insert(chain.steps.begin() + std::ptrdiff_t(place), std::move(step));
}

void duplicateStep(Chain& chain, size_t place) { insertStep(chain, place + 1, Step(chain.steps.at(place))); }

void moveStep(Chain& chain, size_t from, size_t to) {
    auto begin = chain.steps.begin();
    if (from < to)
        std::rotate(begin + std::ptrdiff_t(from), begin + std::ptrdiff_t(from) + 1,
                    begin + std::ptrdiff_t(to) + 1);
    else
        std::rotate(begin + std::ptrdiff_t(to), begin + std::ptrdiff_t(from),
                    begin + std::ptrdiff_t(from) + 1);
}

static void addUnlessThere(std::vector<std::string>& names, const std::string& name) {
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
}

std::vector<std::string> imagesBefore(const Chain& chain, size_t place) {
    std::vector<std::string> names = {"color", "captured", "transmittance"};
    for (size_t k = 0; k < std::min(place, chain.steps.size()); k++)
        addUnlessThere(names, chain.steps[k].output);
    return names;
}

std::vector<std::string> namedImages(const Chain& chain) {
    std::vector<std::string> names = {"transmittance"};
    for (const Step& step : chain.steps)
        if (step.enabled && step.output != "color") addUnlessThere(names, step.output);
    return names;
}

// The value as the new declaration takes it; the default where it does not.
static ParameterValue carriedOver(const Parameter* before, const Parameter& now,
                                  const ParameterValue& value) {
    if (!before || before->type != now.type) return now.defaultValue;
    try {
        return parseValue(now, toJson(*before, value), "");
    } catch (const Error&) {
        return now.defaultValue;
    }
}

void replaceEffect(Chain& chain, const std::shared_ptr<const Effect>& effect) {
    for (Step& step : chain.steps) {
        if (step.effect->header.path != effect->header.path) continue;
        ParameterValues values;
        std::set<std::string> given;
        for (const Parameter& parameter : effect->header.parameters) {
            const Parameter* before = findParameter(step.effect->header.parameters, parameter.name);
            values[parameter.name] = parameter.defaultValue;
            if (!step.given.count(parameter.name) || !before) continue;
            values[parameter.name] = carriedOver(before, parameter, step.values.at(parameter.name));
            given.insert(parameter.name);
        }
        step.effect = effect;
        step.values = std::move(values);
        step.given = std::move(given);
    }
}

}  // namespace brume::preview
