#include "measure/chart.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>

#include "effect/preset.hpp"
#include "error.hpp"
#include "measure/bench.hpp"
#include "measure/number_text.hpp"
#include "measure/peer.hpp"
#include "measure/plot.hpp"
#include "measure/reference.hpp"
#include "measure/stage.hpp"
#include "measure/suspects.hpp"

namespace brume {
namespace {

using json = nlohmann::json;

// ms: runs longer than this fall out of every cache whatever frame they find, and need no turns with a copy:
// three of them are timed; of those over veryLongRun, two.
constexpr double longRun = 250, veryLongRun = 3000;

Chain chainOf(const std::shared_ptr<const Effect>& effect, const ParameterValues& values,
              const std::vector<std::string>& given, const Stage& stage) {
    Step step;
    step.effect = effect;
    step.id = effect->name();
    step.values = values;
    step.given = {given.begin(), given.end()};
    Chain chain;
    chain.steps = {step};
    return stage.placed(withAirlight(withSidecar(chain, stage.frame()), stage.frame()));
}

std::string keyOf(const Step& step) {
    json all;
    for (const Parameter& p : step.effect->header.parameters) all[p.name] = toJson(p, step.values.at(p.name));
    return all.dump();
}

// The pictures of one case and their truths: one truth for all that are asked for with the same parameters,
// because references are slow.
class Judge {
  public:
    Judge(const FramePair& frame, size_t count) : frame_(frame), count_(count) {}

    // `place`: of m among the effect's measurements.
    void judge(const Chain& chain, ChartMeasurement& m, size_t place, const cv::Mat& picture) {
        const std::string key = keyOf(chain.steps[0]);
        auto found = truths_.find(key);
        if (found == truths_.end()) {
            Truth truth{chain, sampleGrid(outputSizeOfChain(chain, frame_), count_), {}};
            truth.pixels = referenceOfChain(chain, frame_, truth.grid.pixels);
            found = truths_.emplace(key, std::move(truth)).first;
        }
        const Truth& truth = found->second;
        m.cells = truth.grid.cells;
        m.errors = encodedErrors(picture, truth.grid.pixels, truth.pixels);
        m.row.error = errorStatistics(m.errors, truth.grid.pixels);
        m.row.hasError = true;
        pictures_.push_back({place, picture, &truth});
    }

    // Looks for worse pixels than the grids': each truth is asked wherever some picture differs most from the
    // best one, and the best one from the second. Forgets the case's pictures, which are large.
    void finish(std::vector<ChartMeasurement>& measurements) {
        auto worst = [&](const Picture& p) -> ErrorStatistics& { return measurements[p.place].row.error; };
        std::stable_sort(pictures_.begin(), pictures_.end(),
                         [&](const Picture& a, const Picture& b) { return worst(a).worst < worst(b).worst; });
        std::vector<cv::Point> suspects;
        for (size_t k = 0; k < pictures_.size() && pictures_.size() > 1; k++) {
            const cv::Mat &one = pictures_[k].image, &other = pictures_[k == 0 ? 1 : 0].image;
            if (one.size() != other.size()) continue;
            for (const cv::Point& p : farthestApart(one, other, 8))
                if (std::find(suspects.begin(), suspects.end(), p) == suspects.end()) suspects.push_back(p);
        }
        for (const auto& [key, truth] : truths_) {
            if (suspects.empty()) break;
            const auto there = referenceOfChain(truth.chain, frame_, suspects);
            for (const Picture& p : pictures_) {
                if (p.truth != &truth) continue;
                const auto error = errorStatistics(encodedErrors(p.image, suspects, there), suspects);
                if (error.compared > 0 && error.worst > worst(p).worst)
                    worst(p).worst = error.worst, worst(p).place = error.place;
            }
        }
        pictures_.clear();
        truths_.clear();
    }

  private:
    struct Truth {
        Chain chain;
        SampleGrid grid;
        std::vector<ReferencePixel> pixels;
    };
    struct Picture {
        size_t place;
        cv::Mat image;
        const Truth* truth;
    };
    const FramePair& frame_;
    size_t count_;
    std::map<std::string, Truth> truths_;
    std::vector<Picture> pictures_;
};

std::vector<FramePair> copiesOf(const FramePair& frame, int count) {
    std::vector<FramePair> copies(size_t(count), frame);
    for (FramePair& copy : copies) {
        copy.color = frame.color.clone();
        copy.depth = frame.depth.clone();
        for (auto& [name, image] : copy.images) image = image.clone();
    }
    return copies;
}

void setTime(ChartRow& row, const Timing& timing) {
    row.milliseconds = timing.median();
    row.low = timing.quartileLow();
    row.high = timing.quartileHigh();
    row.runs = int(timing.milliseconds.size());
}

// What times are compared with: on the CPU a plain copy of the frame, on GL a pass that only copies.
double copyTime(Runner& runner, const Effect& like, const std::vector<FramePair>& frames) {
    if (runner.backend() == Backend::Cpu) return benchPlanned(runner, {}, frames, 16, 1).copy.median();
    auto effect = std::make_shared<Effect>();
    effect->header = parseHeader("frame_copy.fs", R"(/*{"SPACE": "linear",
        "INPUTS": [{"NAME": "inputImage", "TYPE": "image"}]}*/
#include "kit/image.glsl"
void main() { store(fetch(inputImage, pixel())); }
)");
    effect->includePath = like.includePath;
    Step step;
    step.effect = effect;
    step.id = "copy";
    step.values = defaultValues(effect->header.parameters);
    Chain chain;
    chain.steps = {step};
    return benchPlanned(runner, chain, frames, 9, 1).passes.median();
}

bool runsOn(const ChartVariant& variant, const Effect& effect, Backend backend) {
    if (backend == Backend::Gl) return variant.onGl;
    return variant.onCpu && effect.hasCpu();
}

std::string textOf(const EffectHeader& header, const ChartVariant& variant) {
    if (variant.knob.empty()) return {};
    const json value = toJson(*findParameter(header.parameters, variant.knob), variant.knobValue);
    return value.is_string() ? value.get<std::string>() : shortExponent(value.dump());
}

struct PeerJob {
    Chart::Peer peer;
    std::string caseName;
    ParameterValues values, truth;
    std::vector<std::string> given;
};

// Only where code of the effect's own runs anyway: a .fs file alone starts no program.
std::vector<PeerJob> peerJobs(const Effect& effect) {
    std::vector<PeerJob> jobs;
    const Chart* chart = effect.header.chart.get();
    if (!chart || !effect.plugin || !effect.plugin->hasReference()) return jobs;
    std::vector<Chart::Case> cases = chart->cases;
    if (cases.empty()) cases.emplace_back();
    for (const Chart::Case& problem : cases)
        for (const Chart::Peer& peer : chart->peers) {
            if (!listed(peer.cases, problem.name)) continue;
            PeerJob job{peer, problem.name, defaultValues(effect.header.parameters), {}, {}};
            for (const auto* set : {&chart->set, &problem.set})
                for (const auto& [name, value] : *set) {
                    job.values[name] = value;
                    job.given.push_back(name);
                }
            job.truth = job.values;
            for (const auto& [name, value] : chart->reference) job.truth[name] = value;
            jobs.push_back(job);
        }
    return jobs;
}

// One copy for all methods of a backend, the median of those that took turns with them: which is faster must
// not hang on the copy's luck.
void shareCopies(std::vector<ChartMeasurement>& measurements) {
    std::map<std::string, Timing> copies;
    for (const auto& m : measurements)
        if (m.row.copy > 0) copies[m.row.backend].milliseconds.push_back(m.row.copy);
    for (auto& m : measurements)
        if (m.row.copy > 0) m.row.copy = copies[m.row.backend].median();
}

}  // namespace

std::string ChartRow::label() const { return knob.empty() ? method : text(method, ", ", knob, " ", value); }

size_t chartCount(const Effect& effect, const std::vector<Runner*>& runners) {
    size_t count = 0;
    for (const ChartVariant& variant : chartVariants(effect.header))
        for (const Runner* runner : runners) count += runsOn(variant, effect, runner->backend());
    return count + peerJobs(effect).size();
}

std::vector<ChartMeasurement> chartEffect(const std::shared_ptr<const Effect>& effect, const FramePair& frame,
                                          const std::vector<Runner*>& runners, const ChartOptions& options,
                                          const std::function<void(const ChartRow&)>& progress) {
    const Stage stage(effect, frame);
    const std::vector<FramePair> many = copiesOf(stage.frame(), 8);
    const bool isKnown = effect->plugin && effect->plugin->hasReference();
    std::map<const Runner*, double> copies;
    for (Runner* runner : runners) copies[runner] = copyTime(*runner, *effect, many);
    Judge judge(stage.frame(), options.pixels);
    std::vector<ChartMeasurement> measurements;
    auto measure = [&](const ChartVariant& variant) {
        for (Runner* runner : runners) {
            if (!runsOn(variant, *effect, runner->backend())) continue;
            const bool isGl = runner->backend() == Backend::Gl;
            ChartMeasurement m;
            ChartRow& row = m.row;
            row.effect = effect->name();
            row.caseName = variant.caseName;
            row.method = variant.method;
            row.knob = variant.knob;
            row.value = textOf(effect->header, variant);
            row.backend = isGl ? "gl" : "cpu";
            row.device = deviceName(*runner);
            row.frame = frame.name;
            row.size = frame.size();
            try {
                const Chain chain = plannedWhole(chainOf(effect, variant.values, variant.given, stage),
                                                 stage.frame(), runner->backend());
                cv::Mat image;
                Timing alone;
                auto run = [&](int slot) {
                    const auto start = cv::getTickCount();
                    RunResult result = runner->run(chain, many[slot], {});
                    const double wall = double(cv::getTickCount() - start) * 1e3 / cv::getTickFrequency();
                    alone.milliseconds.push_back(isGl ? sumOf(result.timings) : wall);
                    image = result.images["color"];
                };
                run(0);
                const bool isVeryLong = alone.milliseconds[0] > veryLongRun;
                if (!isVeryLong) alone = {};  // it may have compiled, and touched memory first
                run(1);
                image = image.clone();
                if (isKnown)
                    judge.judge(plannedWhole(chainOf(effect, variant.truth, variant.given, stage),
                                             stage.frame(), Backend::Cpu),
                                m, measurements.size(), image);
                if (alone.milliseconds.back() > longRun) {
                    for (int k = 0; k < 2 && !isVeryLong; k++) run(k);
                    setTime(row, alone);
                } else {
                    const BenchResult time =
                        benchPlanned(*runner, chain, many, options.repetitions, options.seconds);
                    setTime(row, isGl ? time.passes : time.chain);
                    if (!isGl) copies[runner] = time.copy.median();
                }
                row.copy = copies[runner];
            } catch (const Error& e) {
                row.problem = e.what();
            }
            if (progress) progress(row);
            measurements.push_back(std::move(m));
        }
    };
    auto measurePeer = [&](const PeerJob& job) {
        ChartMeasurement m;
        ChartRow& row = m.row;
        row.effect = effect->name();
        row.caseName = job.caseName;
        row.method = job.peer.name;
        row.backend = "peer";
        row.frame = frame.name;
        row.size = frame.size();
        try {
            const std::string folder = effect->header.path.substr(0, effect->header.path.rfind('/') + 1);
            const Chain chain =
                plannedWhole(chainOf(effect, job.values, job.given, stage), stage.frame(), Backend::Cpu);
            const PeerResult result = runPeer(folder + job.peer.run, effect->header, chain.steps[0].values,
                                              stage.frame(), options.repetitions);
            row.device = result.device;
            judge.judge(
                plannedWhole(chainOf(effect, job.truth, job.given, stage), stage.frame(), Backend::Cpu), m,
                measurements.size(), result.output);
            setTime(row, result.timing);
        } catch (const Error& e) {
            row.problem = e.what();
        }
        if (progress) progress(row);
        measurements.push_back(std::move(m));
    };
    const auto variants = chartVariants(effect->header);
    const auto peers = peerJobs(*effect);
    std::vector<std::string> cases;
    for (const ChartVariant& v : variants)
        if (std::find(cases.begin(), cases.end(), v.caseName) == cases.end()) cases.push_back(v.caseName);
    for (const std::string& name : cases) {
        for (const ChartVariant& variant : variants)
            if (variant.caseName == name) measure(variant);
        for (const PeerJob& job : peers)
            if (job.caseName == name) measurePeer(job);
        judge.finish(measurements);
    }
    shareCopies(measurements);
    std::vector<ChartRow> rows;
    for (const auto& m : measurements) rows.push_back(m.row);
    markFrontiers(rows);
    for (size_t k = 0; k < rows.size(); k++) measurements[k].row = rows[k];
    return measurements;
}

void markFrontiers(std::vector<ChartRow>& rows) {
    std::map<std::vector<std::string>, std::vector<size_t>> groups;
    for (size_t k = 0; k < rows.size(); k++) {
        rows[k].onFrontier = false;
        if (rows[k].problem.empty() && rows[k].hasError && !rows[k].isPeer())
            groups[{rows[k].effect, rows[k].caseName, rows[k].backend}].push_back(k);
    }
    for (const auto& [key, members] : groups) {
        std::vector<std::pair<double, double>> points;
        for (size_t k : members) points.emplace_back(rows[k].milliseconds, rows[k].error.worst);
        for (size_t place : paretoFrontier(points)) rows[members[place]].onFrontier = true;
    }
}

}  // namespace brume
