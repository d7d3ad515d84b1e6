#include "measure/reference.hpp"

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>

#include "effect/runner.hpp"
#include "error.hpp"

namespace brume {
namespace {

using Images = std::map<std::string, cv::Mat, std::less<>>;

const cv::Mat& imageNamed(const Images& images, const Step& step, const std::string& name) {
    auto found = images.find(name);
    if (found == images.end() || found->second.empty())
        throw Error(ErrorKind::CheckFailed,
                    text(step.id, ": reads the image '", name, "', which this frame does not have"));
    return found->second;
}

cv::Size sizeOf(const Step& step, const FramePair& frame, cv::Size input) {
    DerivedCache cache;
    DerivedValues derived;
    if (step.effect->plugin)
        derived =
            cache.get(step, step.effect->plugin->makeParams(step.values), deriveContextFor(frame, input));
    return outputSize(step, input, derived);
}

ReferenceContext contextOf(const Step& step, const FramePair& frame, const Images& images) {
    ReferenceContext context;
    context.input = fourChannels(imageNamed(images, step, step.input));
    const cv::Size output = sizeOf(step, frame, context.input.size());
    context.camera = frame.camera.resized(frame.size(), context.input.size());
    context.frameSize = frame.size();
    context.depth = resampleNearest(frame.depth, context.input.size());
    for (const Parameter& p : step.effect->header.parameters)
        if (p.type == ParameterType::Image && p.name != step.effect->header.mainImage()) {
            const cv::Mat& image = imageNamed(images, step, step.imageOf(p.name));
            context.images[p.name] = p.resample ? resampleLinear(fourChannels(image), output) : image;
        }
    context.time = frame.time;
    context.frameIndex = frame.index;
    context.seed = frame.seed;
    context.extras = frame.extras;
    return context;
}

// Some references know many pixels at once, and share them among threads themselves; the others are shared
// here.
std::vector<ReferencePixel> ask(const Step& step, const ReferenceContext& context,
                                std::span<const cv::Point> pixels) {
    const auto& plugin = step.effect->plugin;
    if (!plugin || !plugin->hasReference())
        throw Error(ErrorKind::CheckFailed, text(step.id, ": this effect has no reference"));
    std::vector<ReferencePixel> truth(pixels.size());
    const auto params = plugin->makeParams(step.values);
    int parts = std::max(1, std::min(cv::getNumThreads(), int(pixels.size())));
    std::vector<std::string> problems(parts);
    cv::parallel_for_(
        {0, parts},
        [&](cv::Range range) {
            for (int k = range.start; k < range.end; k++) try {
                    size_t begin = pixels.size() * k / parts, end = pixels.size() * (k + 1) / parts;
                    plugin->reference(params, context, pixels.subspan(begin, end - begin),
                                      std::span(truth).subspan(begin, end - begin));
                } catch (const std::exception& e) {
                    problems[k] = e.what();
                }
        },
        parts);
    for (const std::string& problem : problems)
        if (!problem.empty())
            throw Error(ErrorKind::CheckFailed, text(step.id, ": the reference failed: ", problem));
    return truth;
}

std::vector<cv::Point> everyPixel(cv::Size size) {
    std::vector<cv::Point> pixels;
    for (int j = 0; j < size.height; j++)
        for (int i = 0; i < size.width; i++) pixels.emplace_back(i, j);
    return pixels;
}

std::vector<const Step*> enabled(const Chain& chain) {
    std::vector<const Step*> steps;
    for (const Step& step : chain.steps)
        if (step.enabled) steps.push_back(&step);
    return steps;
}

}  // namespace

bool hasReference(const Chain& chain) {
    const auto steps = enabled(chain);
    return std::all_of(steps.begin(), steps.end(), [](const Step* step) {
        return step->effect->plugin && step->effect->plugin->hasReference();
    });
}

cv::Size outputSizeOfChain(const Chain& chain, const FramePair& frame) {
    std::map<std::string, cv::Size> sizes;
    for (const auto& [name, image] : frame.images) sizes[name] = image.size();
    sizes["color"] = sizes["captured"] = sizes["transmittance"] = frame.size();
    for (const Step* step : enabled(chain)) {
        auto input = sizes.find(step->input);
        if (input == sizes.end())
            throw Error(ErrorKind::CheckFailed,
                        text(step->id, ": reads the image '", step->input, "', which does not exist"));
        sizes[step->output] = sizeOf(*step, frame, input->second);
    }
    return sizes["color"];
}

std::vector<ReferencePixel> referenceOfChain(const Chain& chain, const FramePair& frame,
                                             std::span<const cv::Point> pixels) {
    Images images(frame.images.begin(), frame.images.end());
    images["color"] = images["captured"] = frame.color;
    images["transmittance"] = cv::Mat(frame.size(), CV_32FC4, cv::Scalar::all(1));
    const auto steps = enabled(chain);
    auto keepsPixels = [](const Step& step) {
        return step.effect->header.pointwise && step.input == "color" && step.output == "color";
    };
    size_t last =
        steps.empty() ? 0 : steps.size() - 1;  // that has to be known at every pixel, but for its output
    while (last > 0 && keepsPixels(*steps[last])) last--;

    std::vector<ReferencePixel> result(pixels.size());
    for (size_t n = 0; n < pixels.size(); n++) result[n].color = frame.color.at<cv::Vec4f>(pixels[n]);
    for (size_t k = 0; k < steps.size(); k++) {
        const Step& step = *steps[k];
        const cv::Size size = sizeOf(step, frame, imageNamed(images, step, step.input).size());
        const bool isSparse = k >= last && step.output == "color";
        std::vector<cv::Point> all;
        if (!isSparse) all = everyPixel(size);
        const std::span<const cv::Point> asked = isSparse ? pixels : std::span<const cv::Point>(all);
        const auto truth = ask(step, contextOf(step, frame, images), asked);

        cv::Mat output(size, CV_32FC4, cv::Scalar()), through;
        if (step.effect->header.writesTransmittance && size == frame.size())
            through = images["transmittance"] = images["transmittance"].clone();
        for (size_t n = 0; n < asked.size(); n++) {
            output.at<cv::Vec4f>(asked[n]) = truth[n].color;
            if (through.empty()) continue;
            auto& t = through.at<cv::Vec4f>(asked[n]);
            t = cv::Vec4d(t).mul(truth[n].transmittance);
        }
        images[step.output] = output;
        if (step.output != "color") continue;
        for (size_t n = 0; n < pixels.size(); n++) {
            const bool wasAmbiguous = result[n].ambiguous;
            result[n] = truth[isSparse ? n : size_t(pixels[n].y) * size.width + pixels[n].x];
            result[n].ambiguous |= wasAmbiguous;
        }
    }
    if (images["transmittance"].size() == images["color"].size())
        for (size_t n = 0; n < pixels.size(); n++)
            result[n].transmittance = images["transmittance"].at<cv::Vec4f>(pixels[n]);
    return result;
}

}  // namespace brume
