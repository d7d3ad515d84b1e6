#include "measure/plan_check.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <set>

#include "apply/apply.hpp"
#include "effect/header_chart.hpp"
#include "effect/preset.hpp"
#include "error.hpp"
#include "measure/encoded_error.hpp"
#include "measure/reference.hpp"
#include "measure/suspects.hpp"
#include "measure/timer.hpp"

namespace brume {
namespace {

using json = nlohmann::json;

// --- random parameters

double drawNumber(const Parameter& p, int component, cv::RNG& random) {
    const auto& low = p.uiMin.empty() ? p.min : p.uiMin;
    const auto& high = p.uiMax.empty() ? p.max : p.uiMax;
    const double middle =
        component < int(p.defaultValue.numbers.size()) ? p.defaultValue.numbers[component] : 0;
    const double from = low.empty() ? middle - 1 : low[component],
                 to = high.empty() ? middle + 1 : high[component];
    double u = random.uniform(0., 1.);
    if (p.type == ParameterType::Long) return std::floor(from + u * (to - from + 1 - 1e-9));
    if (from > 0 && to / from > 100) return from * std::pow(to / from, u);
    if (from == 0 && p.type == ParameterType::Float) u = u * u * u;
    return from + u * (to - from);
}

ParameterValue drawValue(const Parameter& p, cv::RNG& random) {
    ParameterValue value = p.defaultValue;
    if (p.type == ParameterType::List) {
        value.rows.clear();
        const int rows = random.uniform(0, std::min(p.maxRows, 3) + 1);
        for (int k = 0; k < rows; k++) {
            ParameterValues row;
            for (const Parameter& field : p.fields) row[field.name] = drawValue(field, random);
            value.rows.push_back(row);
        }
        return value;
    }
    value.automatic = p.allowsAuto && p.type != ParameterType::Color;
    if (!p.values.empty())
        value.numbers = {double(p.values[random.uniform(0, int(p.values.size()))])};
    else if (p.type == ParameterType::Bool || p.type == ParameterType::Event)
        value.numbers = {double(random.uniform(0, 2))};
    else if (int count = componentCount(p.type); count > 0) {
        value.numbers.resize(count);
        // A colour's channels are near one another, as lights and fogs are.
        const double grey = p.type == ParameterType::Color ? drawNumber(p, 0, random) : 0;
        for (int c = 0; c < count; c++) {
            value.numbers[c] = drawNumber(p, c, random);
            if (p.type == ParameterType::Color)
                value.numbers[c] = c == 3 ? 1 : .7 * grey + .3 * value.numbers[c];
        }
    }
    return value;
}

// cv::RNG is linear: of states evenly apart, as seeds and numbers are, it may draw the same few choices for
// many sets. Bits are mixed first (the finalizer of splitmix64).
uint64_t mixed(uint64_t bits) {
    bits = (bits ^ bits >> 30) * 0xbf58476d1ce4e5b9u;
    bits = (bits ^ bits >> 27) * 0x94d049bb133111ebu;
    return bits ^ bits >> 31;
}

PlanSet draw(const std::shared_ptr<const Effect>& effect, uint32_t seed, int number) {
    PlanSet set;
    set.number = number;
    set.effect = effect->name();
    cv::RNG random(mixed(mixed(seed) + uint64_t(number) + 1));
    const Chart* chart = effect->header.chart.get();
    if (chart && !chart->before.empty())
        set.chain =
            parsePreset(chart->before, effect->header.path + ": CHART: BEFORE", EffectRegistry::standard());
    Step step;
    step.effect = effect;
    step.id = effect->name();
    json values = json::object();
    for (const Parameter& p : effect->header.parameters) {
        step.values[p.name] = drawValue(p, random);
        // A capture's own images have nothing that could be drawn in their place.
        if (p.type != ParameterType::Image) step.given.insert(p.name);
        const json value = toJson(p, step.values[p.name]);
        if (p.type != ParameterType::Image && value != toJson(p, p.defaultValue)) values[p.name] = value;
    }
    set.values = values.dump();
    // What a capture knows of its lights takes the place of half the sets' own.
    if (random.uniform(0, 2)) {
        for (const Parameter& p : effect->header.parameters)
            if (!p.sidecar.empty()) step.given.erase(p.name);
    }
    set.chain.steps.push_back(step);
    return set;
}

// --- plans

struct Planned {
    Chain stated, run, truth;
    std::vector<StepPlan> decisions;
};

Planned planned(const PlanSet& set, const FramePair& frame) {
    Planned result;
    result.stated = result.truth = withAirlight(withSidecar(set.chain, frame), frame);
    result.run = planChain(result.stated, frame, Backend::Cpu, {}, &result.decisions);
    for (size_t k = 0; k < result.truth.steps.size(); k++)
        for (const auto& from : {&Plan::chosen, &Plan::model})
            for (const auto& [name, value] : result.decisions.at(k).plan.*from)
                if (auto& parameter = result.truth.steps[k].values.at(name);
                    parameter.automatic || from == &Plan::model)
                    parameter = ParameterValue{{value}};
    return result;
}

std::string labelOf(const Step& step, const std::string& name, double value) {
    const json label = toJson(*findParameter(step.effect->header.parameters, name), ParameterValue{{value}});
    return text(name, " = ", label.is_string() ? label.get<std::string>() : label.dump());
}

std::string choiceOf(const Planned& p) {
    const StepPlan& decision = p.decisions.back();
    if (decision.plan.skip) return "skipped";
    std::string choice;
    for (const auto& [name, value] : decision.plan.chosen)
        if (p.stated.steps.back().values.at(name).automatic)
            choice += (choice.empty() ? "" : ", ") + labelOf(p.stated.steps.back(), name, value);
    return choice.empty() ? "as written" : choice;
}

class Judge {
  public:
    Judge(const Planned& p, const FramePair& frame, size_t pixels) : chain_(p.truth), frame_(frame) {
        ask(sampleGrid(outputSizeOfChain(chain_, frame), pixels).pixels);
    }
    ErrorStatistics operator()(const cv::Mat& image) const {
        return errorStatistics(encodedErrors(image, pixels_, truth_), pixels_);
    }
    // Asks the truth also where two pictures differ most: pixels spread evenly may miss the worst.
    void lookWhereApart(const cv::Mat& a, const cv::Mat& b) { ask(farthestApart(a, b, 12)); }

  private:
    const Chain& chain_;
    const FramePair& frame_;
    std::vector<cv::Point> pixels_;
    std::vector<ReferencePixel> truth_;

    void ask(const std::vector<cv::Point>& pixels) {
        const auto truth = referenceOfChain(chain_, frame_, pixels);
        pixels_.insert(pixels_.end(), pixels.begin(), pixels.end());
        truth_.insert(truth_.end(), truth.begin(), truth.end());
    }
};

PlanCheck resultOf(const PlanSet& set, const FramePair& frame, const Planned& p) {
    PlanCheck check;
    check.effect = set.effect;
    check.frame = frame.name;
    check.values = set.values;
    check.set = set.number;
    check.choice = choiceOf(p);
    check.isSkipped = p.decisions.back().plan.skip;
    check.why = p.decisions.back().plan.why;
    for (const StepPlan& decision : p.decisions) check.predicted += decision.plan.predictedError;
    return check;
}

void setError(PlanCheck& check, const ErrorStatistics& error) {
    check.measured = error.worst / 255;
    check.compared = error.compared;
    check.leftOut = error.leftOut;
    check.worst = error.place;
}

// What CHART sweeps, of those parameters that this set leaves to the plan; `finest`: of each method its
// knob's last value alone.
std::vector<std::map<std::string, double>> sweepOf(const Step& step, bool finest) {
    std::set<std::map<std::string, double>> found;
    const Chart* chart = step.effect->header.chart.get();
    if (!chart) return {};
    auto isFree = [&](const std::string& name) { return step.values.at(name).automatic; };
    for (const Chart::Method& method : chart->methods) {
        std::map<std::string, double> values;
        for (const auto& [name, value] : method.set)
            if (isFree(name) && !value.automatic) values[name] = value.numbers.at(0);
        const bool hasKnob = !method.knob.empty() && isFree(method.knob);
        if (!hasKnob && !values.empty()) found.insert(values);
        for (size_t k = 0; hasKnob && k < method.values.size(); k++) {
            if (finest && k + 1 < method.values.size()) continue;
            values[method.knob] = method.values[k].numbers.at(0);
            found.insert(values);
        }
    }
    return {found.begin(), found.end()};
}

// The chain with other values in its last step; the steps before are as planned.
Chain changed(const Planned& p, const std::map<std::string, double>& values) {
    Chain chain = p.truth;
    for (const auto& [parameter, value] : values)
        chain.steps.back().values.at(parameter) = ParameterValue{{value}};
    for (size_t k = 0; k + 1 < chain.steps.size(); k++)
        if (p.decisions[k].plan.skip) chain.steps[k].enabled = false;
    return chain;
}

double millisecondsOf(const std::function<void()>& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

std::vector<PlanSet> planSets(const std::vector<std::shared_ptr<const Effect>>& effects, uint32_t seed,
                              int first, int count) {
    std::vector<PlanSet> sets;
    for (int number = first; number < first + count; number++)
        sets.push_back(draw(effects[size_t(number) % effects.size()], seed, number));
    return sets;
}

FramePair resizedFrame(const FramePair& frame, cv::Size size) {
    FramePair resized = frame;
    resized.color = resampleNearest(frame.color, size);
    resized.depth = resampleNearest(frame.depth, size);
    resized.camera = frame.camera.resized(frame.size(), size);
    resized.fullSize = {};
    return resized;
}

PlanCheck checkPlan(Runner& cpu, const PlanSet& set, const FramePair& frame, size_t pixels) {
    const Planned p = planned(set, frame);
    PlanCheck check = resultOf(set, frame, p);
    Judge judge(p, frame, pixels);
    const cv::Mat chosen = cpu.run(p.run, frame, {}).images.at("color").clone();
    for (const auto& values : sweepOf(p.stated.steps.back(), true))
        judge.lookWhereApart(cpu.run(changed(p, values), frame, {}).images.at("color"), chosen);
    setError(check, judge(chosen));
    return check;
}

PlanCheck timePlan(Runner& cpu, const PlanSet& set, const FramePair& frame, size_t pixels) {
    Planned p = planned(set, frame);
    const double planning = millisecondsOf([&] { p = planned(set, frame); });
    PlanCheck check = resultOf(set, frame, p);
    check.isTimed = true;
    check.planMs = planning;
    // Copies, so that no candidate finds the caches warm with what it reads.
    std::vector<FramePair> frames(2, frame);
    for (FramePair& copy : frames) copy.color = frame.color.clone(), copy.depth = frame.depth.clone();
    auto run = [&](const Chain& chain, int slot) { return cpu.run(chain, frames[size_t(slot) % 2], {}); };
    Judge judge(p, frame, pixels);
    const cv::Mat chosen = run(p.run, 0).images.at("color").clone();
    setError(check, judge(chosen));
    const Step& step = p.stated.steps.back();
    const auto sweep = sweepOf(step, false);
    if (check.isSkipped || sweep.empty()) return check;

    // The others, fastest first; a sixteenth of the pixels tells how fast.
    struct Other {
        Chain chain;
        std::string name;
        double smallMs = 0;
    };
    const FramePair small = resizedFrame(frame, frame.size() / 4);
    auto smallMs = [&](const Chain& chain) {
        auto once = [&] { return millisecondsOf([&] { cpu.run(chain, small, {}); }); };
        once();
        return std::min(once(), once());
    };
    const double chosenSmallMs = smallMs(p.run);
    std::vector<Other> others;
    for (const auto& values : sweep) {
        Other other{changed(p, values), "", 0};
        bool isChosen = true;
        for (const auto& [parameter, value] : values) {
            isChosen &= p.run.steps.back().values.at(parameter).numbers.at(0) == value;
            other.name += (other.name.empty() ? "" : ", ") + labelOf(step, parameter, value);
        }
        if (isChosen) continue;
        const double atLeast = millisecondsOf([&] { cpu.run(other.chain, small, {}); });
        if (atLeast > 2 * chosenSmallMs) continue;
        other.smallMs = smallMs(other.chain);
        others.push_back(other);
    }
    std::sort(others.begin(), others.end(),
              [](const Other& a, const Other& b) { return a.smallMs < b.smallMs; });
    std::vector<Candidate> candidates = {{"chosen", [&](int slot) { run(p.run, slot); }}};
    double bestSmallMs = chosenSmallMs;
    for (const Other& other : others) {
        if (other.smallMs > 1.3 * bestSmallMs) break;
        const cv::Mat image = run(other.chain, 0).images.at("color");
        if (judge(image).worst / 255 > unseenError) continue;
        judge.lookWhereApart(image, chosen);
        if (judge(image).worst / 255 > unseenError) continue;
        candidates.push_back({other.name, [&run, &other](int slot) { run(other.chain, slot); }});
        bestSmallMs = std::min(bestSmallMs, other.smallMs);
    }
    setError(check, judge(chosen));
    const auto timings = takeTurns(candidates, 2, 7, 1.5);
    check.chosenMs = check.bestMs = timings[0].median();
    check.best = check.choice;
    for (const Timing& timing : timings)
        if (timing.median() < check.bestMs) check.bestMs = timing.median(), check.best = timing.name;
    return check;
}

}  // namespace brume
