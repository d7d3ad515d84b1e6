#include "measure/check.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <set>

#include "effect/preset.hpp"
#include "error.hpp"
#include "frame/pending_file.hpp"
#include "frame/write.hpp"
#include "measure/check_mirror.hpp"
#include "measure/check_pixels.hpp"

namespace brume {
namespace {

const char* otherImage = "check_other";

// One frame at one parameter set, through both halves and the reference.
struct Trial {
    const CheckFrame* source = nullptr;
    CheckCase result;
    cv::Mat cpuColor, cpuTransmittance, glColor, glTransmittance;
    std::vector<cv::Point> pixels;  // where the reference is asked
    size_t spread = 0;              // the first so many were chosen without a look at the halves
    std::vector<ReferencePixel> truth;

    void fail(const std::string& problem) {
        if (result.problem.empty()) result.problem = problem;
    }
};

// Every pixel where the halves differ is asked about, so of all pixels those excused are known. How many are
// called ambiguous whether or not they differ, only the evenly spread ones tell.
struct AmbiguousShare {
    size_t leftOut = 0, all = 0;
    void add(size_t out, size_t judged) { leftOut += out, all += out + judged; }
    bool isTooLarge() const { return double(leftOut) > maxAmbiguousShare * double(all); }
};

struct Subject {
    std::shared_ptr<const Effect> effect;
    bool hasCpu, hasReference, readsOtherImages, isPersistent;
    std::vector<std::string> keep;

    explicit Subject(const std::shared_ptr<const Effect>& e) : effect(e) {
        hasCpu = e->hasCpu();
        hasReference = e->plugin && e->plugin->hasReference();
        if (e->header.writesTransmittance) keep.push_back("transmittance");
        readsOtherImages = std::any_of(
            e->header.parameters.begin(), e->header.parameters.end(),
            [&](auto& p) { return p.type == ParameterType::Image && p.name != e->header.mainImage(); });
        isPersistent = std::any_of(e->header.passes.begin(), e->header.passes.end(),
                                   [](const Pass& pass) { return pass.persistent; });
    }

    cv::Size outputSize(const Step& step, const FramePair& frame) const {
        DerivedCache cache;
        DerivedValues derived;
        if (effect->plugin)
            derived = cache.get(step, effect->plugin->makeParams(step.values),
                                deriveContextFor(frame, frame.size()));
        return brume::outputSize(step, frame.size(), derived);
    }

    Step step(ParameterValues values) const {
        for (const Parameter& p : effect->header.parameters)
            if (p.type == ParameterType::Image && p.name != effect->header.mainImage())
                values[p.name].text = otherImage;
        Step step;
        step.effect = effect;
        step.id = effect->name();
        step.values = std::move(values);
        return step;
    }
};

bool sameBits(const cv::Mat& a, const cv::Mat& b) {
    if (a.size() != b.size() || a.type() != b.type()) return false;
    for (int j = 0; j < a.rows; j++)
        if (std::memcmp(a.ptr(j), b.ptr(j), a.cols * a.elemSize()) != 0) return false;
    return true;
}

std::optional<cv::Point> findNan(const cv::Mat& image) {
    for (int j = 0; j < image.rows; j++)
        for (int i = 0; i < image.cols; i++)
            for (int c = 0; c < image.channels(); c++)
                if (std::isnan(image.ptr<float>(j)[i * image.channels() + c])) return cv::Point(i, j);
    return {};
}

// Still as the guarded runner made it.
bool isUnwritten(const cv::Mat& image, cv::Point place) {
    const uchar* bytes = image.ptr(place.y) + place.x * image.elemSize();
    return std::all_of(bytes, bytes + image.elemSize(), [](uchar byte) { return byte == 0xFF; });
}

// Runs one half twice: same bits, right size, no NaN from finite input.
void runHalf(Runner& runner, const char* half, const Chain& chain, const Subject& subject, Trial& trial,
             cv::Mat& color, cv::Mat& transmittance) {
    RunResult first, second;
    FramePair frame = trial.source->frame;
    frame.color = frame.color.clone();
    cv::Size expected;
    try {
        expected = subject.outputSize(chain.steps.back(), frame);
        first = runner.run(chain, frame, subject.keep);
        if (!sameBits(frame.color, trial.source->frame.color))
            trial.fail(text(half, ": changed its input image"));
        // A persistent target rightly makes the second frame differ from the first.
        if (!subject.isPersistent) second = runner.run(chain, frame, subject.keep);
    } catch (const std::exception& e) {
        return trial.fail(text(half, ": ", e.what()));
    }
    for (const std::string& name : {std::string("color"), std::string("transmittance")}) {
        if (name != "color" && subject.keep.empty()) continue;
        cv::Mat image = first.images[name];
        if (image.type() != CV_32FC4 || image.size() != expected)
            return trial.fail(text(half, ": ", name, " is ", image.cols, "×", image.rows, " of type ",
                                   cv::typeToString(image.type()), ", not ", expected.width, "×",
                                   expected.height, " CV_32FC4"));
        if (!subject.isPersistent && !sameBits(image, second.images[name]))
            trial.fail(text(half, ": two runs gave different ", name,
                            ": pixels never stored, or read while they are written, do that"));
        // Transmittance never depends on colour's class.
        if (trial.source->finiteColor)
            if (auto place = findNan(image))
                trial.fail(text(half, ": ",
                                isUnwritten(image, *place) ? "left unwritten: a pixel of " : "NaN in ", name,
                                " at (", place->x, ", ", place->y, ") from finite input"));
        (name == "color" ? color : transmittance) = image.clone();
    }
}

double valueAt(const cv::Mat& image, cv::Point place, int channel) {
    return image.ptr<float>(place.y)[place.x * image.channels() + channel];
}

// Takes one image's comparison into the case's.
void merge(Comparison& whole, WorstPixel& worst, const Comparison& part, const std::string& image) {
    bool isWorse = whole.compared + whole.leftOut == 0 || part.worstOfBound > whole.worstOfBound;
    size_t compared = whole.compared + part.compared;
    Comparison merged = isWorse ? part : whole;
    if (compared) merged.mean = (whole.mean * whole.compared + part.mean * part.compared) / double(compared);
    merged.passed = whole.passed && part.passed;
    merged.compared = compared;
    merged.leftOut = whole.leftOut + part.leftOut;
    merged.failed = whole.failed + part.failed;
    whole = merged;
    if (isWorse) worst = {image, part.place, part.channel, {}, {}, {}};
}

// How one of a pixel's two images is judged.
struct Bounds {
    cv::Vec4d truth;
    double scale, allowance, methodError;
};
Bounds boundsOf(const ReferencePixel& truth, bool isColor) {
    if (isColor) return {truth.color, truth.scale, truth.allowance, truth.methodError};
    return {truth.transmittance, 1, truth.transmittanceAllowance, truth.transmittanceMethodError};
}

// The bound of MODELS.md, relative to the reference's scale. Where that or the allowance is not finite (C =
// inf in one channel) only the values themselves can say what precision means.
double referenceBound(const Tolerance& tolerance, const Bounds& bounds) {
    double largest = 1;
    for (int c = 0; c < 4; c++)
        if (std::isfinite(bounds.truth[c])) largest = std::max(largest, std::abs(bounds.truth[c]));
    return tolerance.reference * (std::isfinite(bounds.scale) ? bounds.scale : largest) +
           (std::isfinite(bounds.allowance) ? bounds.allowance : tolerance.rel * largest) +
           (std::isfinite(bounds.methodError) ? bounds.methodError : 0);
}

void compareParity(const Subject& subject, Trial& trial) {
    const Tolerance& tolerance = subject.effect->header.tolerance;
    cv::Mat ambiguous = cv::Mat::zeros(trial.cpuColor.size(), CV_8U);
    for (size_t k = 0; k < trial.truth.size(); k++)
        ambiguous.at<uint8_t>(trial.pixels[k]) = trial.truth[k].ambiguous;
    trial.result.parity = {};
    auto compare = [&](const cv::Mat& gl, const cv::Mat& cpu, bool isColor) {
        cv::Mat allowance = cv::Mat::zeros(cpu.size(), CV_64F);
        for (size_t k = 0; k < trial.truth.size(); k++) {
            const double allowed = boundsOf(trial.truth[k], isColor).allowance;
            if (std::isfinite(allowed)) allowance.at<double>(trial.pixels[k]) = allowed;
        }
        merge(trial.result.parity, trial.result.parityWorst,
              compareImages(gl, cpu, tolerance.abs, tolerance.rel, allowance, ambiguous),
              isColor ? "color" : "transmittance");
    };
    compare(trial.glColor, trial.cpuColor, true);
    if (!trial.cpuTransmittance.empty()) compare(trial.glTransmittance, trial.cpuTransmittance, false);
}

// Where the reference is asked: spread over the frame, where the halves differ (it may know that no method
// can tell), and where they differ most.
void choosePixels(const Subject& subject, const CheckOptions& options, Trial& trial) {
    const cv::Mat& any = subject.hasCpu ? trial.cpuColor : trial.glColor;
    trial.pixels = spreadPixels(any.size(), options.referencePixels);
    trial.spread = trial.pixels.size();
    if (!subject.hasCpu) return;
    std::set<std::pair<int, int>> seen;
    for (cv::Point p : trial.pixels) seen.insert({p.x, p.y});
    auto add = [&](cv::Point p) {
        if (seen.insert({p.x, p.y}).second) trial.pixels.push_back(p);
    };
    compareParity(subject, trial);
    add(trial.result.parityWorst.place);
    if (trial.result.parity.passed) return;
    const Tolerance& tolerance = subject.effect->header.tolerance;
    for (int j = 0; j < any.rows; j++)
        for (int i = 0; i < any.cols; i++) {
            cv::Rect pixel(i, j, 1, 1);
            auto differs = [&](const cv::Mat& gl, const cv::Mat& cpu) {
                return !gl.empty() &&
                       !compareImages(gl(pixel), cpu(pixel), tolerance.abs, tolerance.rel).passed;
            };
            if (differs(trial.glColor, trial.cpuColor) ||
                differs(trial.glTransmittance, trial.cpuTransmittance))
                add({i, j});
        }
}

void askReference(const Subject& subject, const ParameterValues& values, Trial& trial) {
    const FramePair& frame = trial.source->frame;
    ReferenceContext context{frame.camera, frame.size(), frame.color, frame.depth, {},
                             frame.time,   frame.index,  frame.seed,  frame.extras};
    for (const Parameter& p : subject.effect->header.parameters)
        if (p.type == ParameterType::Image && p.name != subject.effect->header.mainImage())
            context.images[p.name] = mirrored(frame.color);
    const PluginEffect& plugin = *subject.effect->plugin;
    trial.truth.resize(trial.pixels.size());
    plugin.reference(plugin.makeParams(values), context, trial.pixels, trial.truth);
}

void compareReference(const Subject& subject, Trial& trial) {
    const cv::Mat& color = subject.hasCpu ? trial.cpuColor : trial.glColor;
    const cv::Mat& transmittance = subject.hasCpu ? trial.cpuTransmittance : trial.glTransmittance;
    int count = int(trial.pixels.size());
    cv::Mat ours(1, count, CV_64FC4), truth(1, count, CV_64FC4), bound(1, count, CV_64F),
        ambiguous(1, count, CV_8U);
    auto compare = [&](const cv::Mat& image, bool isColor) {
        for (int k = 0; k < count; k++) {
            const Bounds bounds = boundsOf(trial.truth[k], isColor);
            ours.at<cv::Vec4d>(k) = image.at<cv::Vec4f>(trial.pixels[k]);
            truth.at<cv::Vec4d>(k) = bounds.truth;
            bound.at<double>(k) = referenceBound(subject.effect->header.tolerance, bounds);
            ambiguous.at<uint8_t>(k) = trial.truth[k].ambiguous;
        }
        Comparison part = compareImages(ours, truth, 0, 0, bound, ambiguous);
        part.place = trial.pixels[part.place.x];
        merge(trial.result.reference, trial.result.referenceWorst, part, isColor ? "color" : "transmittance");
    };
    compare(color, true);
    if (!transmittance.empty()) compare(transmittance, false);
}

void fillWorst(const Trial& trial, WorstPixel& worst) {
    bool isColor = worst.image == "color";
    const cv::Mat& gl = isColor ? trial.glColor : trial.glTransmittance;
    const cv::Mat& cpu = isColor ? trial.cpuColor : trial.cpuTransmittance;
    if (!gl.empty()) worst.gl = valueAt(gl, worst.place, worst.channel);
    if (!cpu.empty()) worst.cpu = valueAt(cpu, worst.place, worst.channel);
    for (size_t k = 0; k < trial.truth.size(); k++)
        if (trial.pixels[k] == worst.place)
            worst.reference = (isColor ? trial.truth[k].color : trial.truth[k].transmittance)[worst.channel];
}

// A filter that only a shader describes should see the scene, not the pixel grid: twice the size must give
// about the same picture.
void checkResolution(Runner& gl, const Chain& chain, Trial& trial) {
    const double largestMean = .03;
    FramePair twice = trial.source->frame;
    const cv::Size size = twice.size() * 2;
    twice.camera = twice.camera.resized(twice.size(), size);
    cv::resize(trial.source->frame.color, twice.color, size, 0, 0, cv::INTER_LINEAR);
    cv::resize(trial.source->frame.depth, twice.depth, size, 0, 0, cv::INTER_NEAREST);
    const cv::Mat &small = trial.glColor, large = gl.run(chain, twice, {}).images["color"];
    cv::Mat reduced;
    cv::resize(large, reduced, small.size(), 0, 0, cv::INTER_AREA);
    double sum = 0;
    for (int j = 0; j < small.rows; j++)
        for (int i = 0; i < small.cols; i++)
            for (int c = 0; c < 3; c++)
                sum += std::abs(std::clamp(small.at<cv::Vec4f>(j, i)[c], 0.0f, 1.0f) -
                                std::clamp(reduced.at<cv::Vec4f>(j, i)[c], 0.0f, 1.0f));
    double mean = sum / (3. * double(small.total()));
    if (!(mean <= largestMean))
        trial.fail(text("at twice the resolution the picture differs by ", mean, " on average, more than ",
                        largestMean, ": lengths in it are pixels, not parts of the picture"));
}

void writeArtefacts(const std::string& root, const Subject& subject, const Chain& chain, Trial& trial) {
    std::string leaf = trial.result.frame + "-" + trial.result.parameters;
    for (char& c : leaf)
        if (!std::isalnum(static_cast<unsigned char>(c)) && c != '-' && c != '_' && c != '.') c = '_';
    std::filesystem::path folder = std::filesystem::path(root) / subject.effect->name() / leaf;
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) failIo("'", folder.string(), "' cannot be made: ", error.message());
    WriteOptions data;
    data.isData = true;
    auto write = [&](const char* name, const cv::Mat& image) {
        if (!image.empty()) writeImage((folder / name).string(), image, data);
    };
    write("cpu.exr", trial.cpuColor);
    write("gl.exr", trial.glColor);
    if (!trial.cpuColor.empty() && trial.cpuColor.size() == trial.glColor.size()) {
        cv::Mat difference;
        cv::absdiff(trial.cpuColor, trial.glColor, difference);
        write("difference.exr", difference);
    }
    if (!trial.truth.empty()) {  // known at some pixels only; NaN elsewhere
        cv::Mat truth(trial.cpuColor.empty() ? trial.glColor.size() : trial.cpuColor.size(), CV_32FC4,
                      cv::Scalar::all(std::nan("")));
        for (size_t k = 0; k < trial.truth.size(); k++)
            truth.at<cv::Vec4f>(trial.pixels[k]) = trial.truth[k].color;
        write("reference.exr", truth);
    }
    writeWhole((folder / "preset.json").string(), writePreset(chain));
    trial.result.artefacts = folder.string();
}

}  // namespace

std::vector<CheckCase> checkEffect(const std::shared_ptr<const Effect>& effect, Runner& cpu, Runner& gl,
                                   const CheckOptions& options,
                                   const std::function<void(const CheckCase&)>& progress) {
    static const std::vector<CheckFrame> frames = checkFrames();
    Subject subject(effect);
    std::vector<CheckCase> cases;
    AmbiguousShare excused, sampled;
    for (const auto& [parametersName, values] : checkParameters(effect->header, options)) {
        Chain chain;
        if (subject.readsOtherImages) {
            Step mirror;
            mirror.effect = mirrorEffect();
            mirror.id = mirror.effect->name();
            mirror.values = defaultValues(mirror.effect->header.parameters);
            mirror.output = otherImage;
            chain.steps.push_back(mirror);
        }
        chain.steps.push_back(subject.step(values));
        std::vector<Trial> trials(frames.size());
        for (size_t k = 0; k < frames.size(); k++) {
            Trial& trial = trials[k];
            trial.source = &frames[k];
            trial.result.effect = effect->name();
            trial.result.frame = frames[k].name;
            trial.result.parameters = parametersName;
            if (subject.hasCpu)
                runHalf(cpu, "CPU", chain, subject, trial, trial.cpuColor, trial.cpuTransmittance);
            runHalf(gl, "GLSL", chain, subject, trial, trial.glColor, trial.glTransmittance);
            if (trial.glColor.empty() || (subject.hasCpu && trial.cpuColor.empty())) continue;  // a problem
            if (subject.hasReference) choosePixels(subject, options, trial);
            if (!subject.hasCpu && frames[k].name == "ground") checkResolution(gl, chain, trial);
        }
        // References are slow and independent.
        if (subject.hasReference)
            cv::parallel_for_({0, int(trials.size())}, [&](cv::Range range) {
                for (int k = range.start; k < range.end; k++) try {
                        if (!trials[k].pixels.empty()) askReference(subject, values, trials[k]);
                    } catch (const std::exception& e) {
                        trials[k].truth.clear();
                        trials[k].fail(text("reference: ", e.what()));
                    }
            });
        bool wroteArtefacts = false;
        for (Trial& trial : trials) {
            if (subject.hasCpu && !trial.cpuColor.empty() && !trial.glColor.empty()) {
                compareParity(subject, trial);
                fillWorst(trial, trial.result.parityWorst);
            }
            if (!trial.truth.empty()) {
                compareReference(subject, trial);
                fillWorst(trial, trial.result.referenceWorst);
            }
            excused.add(trial.result.parity.leftOut, trial.result.parity.compared);
            for (size_t k = 0; k < trial.spread && !trial.truth.empty(); k++)
                sampled.add(trial.truth[k].ambiguous, !trial.truth[k].ambiguous);
            if (!trial.result.passed() && !options.artefacts.empty() && !wroteArtefacts) {
                writeArtefacts(options.artefacts, subject, chain, trial);
                wroteArtefacts = true;
            }
            cases.push_back(trial.result);
            if (progress) progress(cases.back());
        }
    }
    for (const AmbiguousShare& share : {excused, sampled}) {
        if (!share.isTooLarge()) continue;
        CheckCase all;
        all.effect = effect->name();
        all.frame = "all frames";
        all.parameters = "all";
        all.problem = text(share.leftOut, " of ", share.all, " pixels were left out as ambiguous, more than ",
                           100 * maxAmbiguousShare, " %");
        cases.push_back(all);
        if (progress) progress(all);
        break;
    }
    return cases;
}

}  // namespace brume
