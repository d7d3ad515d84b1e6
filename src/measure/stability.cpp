#include "measure/stability.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "apply/apply.hpp"
#include "error.hpp"
#include "frame/color_encoding.hpp"

namespace brume {

using json = nlohmann::json;

namespace {

constexpr double halfStep = .5;

// Texts that mention $stress become numbers.
json evaluated(const json& item, double stress) {
    if (item.is_string() && item.get<std::string>().find('$') != std::string::npos)
        return SizeExpression(item.get<std::string>()).evaluate({{"stress", stress}});
    json result = item;
    if (item.is_structured())
        for (auto& [key, value] : result.items()) value = evaluated(value, stress);
    return result;
}

json merged(const json& base, const json& more, double stress) {
    json all = base;
    all.update(more);
    return evaluated(all, stress);
}

// Everything one point needs: the frame, the values, and the values that the reference is asked with.
struct Setting {
    ProbeFrame probe;
    Step step;
    std::string key;      ///< settings of one key have one truth
    std::string refusal;  ///< why the header's MIN and MAX do not allow a value; empty: they do
};

Setting settingFor(const std::shared_ptr<const Effect>& effect, const Regime& regime, const RegimeLine& line,
                   double stress) {
    const std::string where = text(effect->header.path, ": STABILITY '", regime.name, "'");
    const json frame = merged(*regime.frame, *line.frame, stress);
    const json set = merged(*regime.set, *line.set, stress);
    Setting setting;
    setting.probe = probeFrame(frame, where + ": FRAME");
    setting.step.effect = effect;
    setting.step.id = effect->name();
    ParameterValues& values = setting.step.values;
    values = defaultValues(effect->header.parameters);
    json judged = set;  // what the plan may choose does not change what is computed
    for (const Parameter& p : effect->header.parameters) {
        if (p.type == ParameterType::Image && p.name != effect->header.mainImage())
            values[p.name].text = "ramp";
        if (set.contains(p.name)) try {
                values[p.name] = parseValue(p, set[p.name], where + ": SET");
            } catch (const Error& e) {
                setting.refusal = e.what();
                return setting;
            }
        if (p.allowsAuto && p.type == ParameterType::Long) judged.erase(p.name);
    }
    json truthFrame = frame;
    truthFrame.erase("STORED");
    setting.key = judged.dump() + truthFrame.dump();
    return setting;
}

using Truth = std::vector<ReferencePixel>;

Truth truthOf(const Setting& setting) {
    const FramePair& frame = setting.probe.frame;
    ReferenceContext context{frame.camera, frame.size(), frame.color, setting.probe.truth, {},
                             frame.time,   frame.index,  frame.seed,  frame.extras};
    ParameterValues values = setting.step.values;
    const EffectHeader& header = setting.step.effect->header;
    for (const Parameter& p : header.parameters) {
        if (p.type == ParameterType::Image && p.name != header.mainImage())
            context.images[p.name] = frame.images.at("ramp");
        if (ParameterValue& value = values.at(p.name); value.automatic) {
            value.automatic = false;
            if (!p.values.empty()) value.numbers = {double(p.values.front())};
        }
    }
    std::vector<cv::Point> pixels;
    for (int j = 0; j < frame.size().height; j++)
        for (int i = 0; i < frame.size().width; i++) pixels.emplace_back(i, j);
    Truth truth(pixels.size());
    const PluginEffect& plugin = *setting.step.effect->plugin;
    plugin.reference(plugin.makeParams(values), context, pixels, truth);
    return truth;
}

const char* classOf(double x) {
    return std::isnan(x) ? "NaN" : std::isinf(x) ? (x < 0 ? "-inf" : "inf") : "";
}

// The worst pixel, in 8-bit steps after encoding; +inf and a sentence where classes differ.
void measure(const cv::Mat& color, const Truth& truth, StabilityPoint& point) {
    if (color.total() != truth.size()) {
        point.error = HUGE_VAL;
        point.problem =
            text("the output has ", color.cols, "×", color.rows, " px, the reference ", truth.size());
        return;
    }
    size_t compared = 0;
    for (int j = 0; j < color.rows; j++)
        for (int i = 0; i < color.cols; i++) {
            const ReferencePixel& pixel = truth[size_t(j) * color.cols + i];
            if (pixel.ambiguous) continue;
            compared++;
            for (int c = 0; c < 4; c++) {
                const double ours = color.at<cv::Vec4f>(j, i)[c], theirs = pixel.color[c];
                // In the class an fp32 output can have.
                const char *ourClass = classOf(ours), *theirClass = classOf(double(float(theirs)));
                if (std::string(ourClass) != theirClass) {
                    point.error = HUGE_VAL;
                    point.problem = text(ours, " where ", theirs, " is right, at (", i, ", ", j, ")");
                    return;
                }
                if (*ourClass) continue;
                auto shown = [&](double x) {
                    x = std::clamp(x, 0., 1.);
                    return 255 * (c < 3 ? srgbEncode(x) : x);
                };
                point.error = std::max(point.error, std::abs(shown(ours) - shown(theirs)));
            }
        }
    if (!compared) {
        point.error = HUGE_VAL;
        point.problem = "every pixel is ambiguous: the regime compares nothing";
    }
}

std::string choiceText(const Step& step, const std::vector<std::string>& names) {
    std::string all;
    for (const std::string& name : names) {
        const Parameter& p = *findParameter(step.effect->header.parameters, name);
        json value = toJson(p, step.values.at(name));
        all += (all.empty() ? "" : ", ") +
               (value.is_string() ? value.get<std::string>() : name + " " + value.dump());
    }
    return all;
}

StabilityPoint runPoint(Runner& runner, const Regime& regime, const RegimeLine& line, const Setting& setting,
                        const Truth& truth, double stress) {
    StabilityPoint point;
    point.stress = stress;
    Chain chain;
    chain.steps = {setting.step};
    try {
        if (line.isAuto) {
            std::vector<StepPlan> decisions;
            chain = planChain(chain, setting.probe.frame, runner.backend(), {}, &decisions);
            point.chosen =
                chain.steps.empty() ? "skipped" : choiceText(chain.steps[0], regime.autoParameters);
        }
        RunResult result = runner.run(chain, setting.probe.frame, {});
        measure(result.images.at("color"), truth, point);
    } catch (const std::exception& e) {
        point.error = HUGE_VAL;
        point.problem = e.what();
    }
    return point;
}

}  // namespace

bool StabilityPoint::holds() const { return !refused && error <= halfStep; }

std::vector<Crossing> StabilityLine::crossings() const {
    std::vector<Crossing> places;
    for (size_t k = 0; k + 1 < points.size(); k++) {
        const StabilityPoint &a = points[k], &b = points[k + 1];
        if (a.refused || b.refused || a.holds() == b.holds()) continue;
        Crossing crossing{k, 0};
        if (a.stress > 0 && a.error > 0 && b.error > 0 && std::isfinite(b.stress) && std::isfinite(a.error) &&
            std::isfinite(b.error))
            crossing.near = a.stress * std::pow(b.stress / a.stress,
                                                std::log(halfStep / a.error) / std::log(b.error / a.error));
        places.push_back(crossing);
    }
    return places;
}

std::vector<StabilityLine> sweepRegime(const std::shared_ptr<const Effect>& effect, const Regime& regime,
                                       const std::vector<Runner*>& runners,
                                       const std::function<void()>& progress) {
    if (!effect->plugin || !effect->plugin->hasReference())
        failUsage(effect->name(), " has no reference to be judged by");
    std::vector<StabilityLine> lines;
    for (const RegimeLine& line : regime.lines)
        for (Runner* runner : runners) {
            if (runner->backend() == Backend::Gl && !line.onGl) continue;
            lines.push_back({line.name, runner->backend(), {}});
        }
    for (double stress : regime.values) {
        std::map<std::string, Truth> truths;
        auto line = lines.begin();
        for (const RegimeLine& declared : regime.lines) {
            const Setting setting = settingFor(effect, regime, declared, stress);
            Truth& truth = truths[setting.key];
            if (setting.refusal.empty() && truth.empty()) truth = truthOf(setting);
            for (Runner* runner : runners) {
                if (runner->backend() == Backend::Gl && !declared.onGl) continue;
                StabilityPoint point;
                point.stress = stress;
                point.refused = !setting.refusal.empty();
                point.problem = setting.refusal;
                if (!point.refused) point = runPoint(*runner, regime, declared, setting, truth, stress);
                (line++)->points.push_back(point);
            }
        }
        if (progress) progress();
    }
    return lines;
}

std::vector<std::string> contradictions(const Regime& regime, const std::vector<StabilityLine>& lines) {
    std::vector<std::string> sentences;
    for (size_t k = 0; k < regime.values.size(); k++) {
        const double stress = regime.values[k];
        std::map<std::string, bool> holds;  // on every backend
        for (const StabilityLine& line : lines)
            holds.try_emplace(line.name, true).first->second &= line.points[k].holds();
        std::string sound;  // a method that the plan could have chosen
        bool hasAuto = false, autoHolds = false;
        for (const RegimeLine& line : regime.lines)
            if (line.isAuto)
                hasAuto = true, autoHolds = holds[line.name];
            else if (sound.empty() && holds[line.name])
                sound = line.name;
        for (const RegimeLine& declared : regime.lines) {
            const StabilityPoint* worst = nullptr;
            Backend where = Backend::Cpu;
            for (const StabilityLine& line : lines) {
                const StabilityPoint& point = line.points[k];
                if (line.name != declared.name || (worst && point.error <= worst->error)) continue;
                worst = &point;
                where = line.backend;
            }
            auto say = [&](const auto&... parts) {
                sentences.push_back(text(regime.effect, ", '", regime.name, "': at ", regime.stress, " ",
                                         stress, regime.unit.empty() ? "" : " ", regime.unit, ", ",
                                         declared.name, " ", parts...));
            };
            if (!worst) continue;
            if (regime.isRefused(stress) != worst->refused) {
                say(worst->refused ? "must run, but is refused: " + worst->problem
                                   : "must be refused by MIN or MAX, but runs");
            } else if (worst->refused) {
                continue;
            } else if (declared.holdsAt(stress)) {
                if (worst->holds()) continue;
                say("must hold, but is off by ", worst->error, " 8-bit steps ",
                    where == Backend::Cpu ? "on the CPU" : "in GLSL",
                    worst->problem.empty() ? "" : ": " + worst->problem,
                    worst->chosen.empty() ? "" : " (" + worst->chosen + ")");
            } else if (worst->holds()) {
                say("is said to fail, but holds everywhere: HOLDS is out of date");
            } else if (declared.isAuto && !sound.empty()) {
                say("fails, where ", sound, " holds",
                    worst->chosen.empty() ? "" : " (" + worst->chosen + " was chosen)");
            } else if (!(hasAuto && autoHolds) && regime.breaks.empty()) {
                say("fails, where auto does not hold either and BREAKS is silent");
            }
        }
    }
    return sentences;
}

}  // namespace brume
