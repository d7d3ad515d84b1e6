#include "measure/papers.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "error.hpp"
#include "frame/color_encoding.hpp"
#include "measure/bench.hpp"
#include "measure/timer.hpp"

namespace brume {
namespace {

constexpr double longRun = 250;  // ms: three runs are enough

FramePair resized(const FramePair& frame, cv::Size size) {
    if (size.empty() || size == frame.size()) return frame;
    FramePair other = frame;
    other.color = resampleLinear(frame.color, size);
    other.depth = resampleNearest(frame.depth, size);
    other.camera = frame.camera.resized(frame.size(), size);
    return other;
}

// A lights' list that the effect does not know, or a frame without sidecar, leaves the values as written.
Chain boundTo(const Chain& chain, const FramePair& frame, Backend backend) {
    return plannedWhole(withAirlight(withSidecar(chain, frame), frame), frame, backend);
}

cv::Mat measure(PaperResult& result, Runner& runner, const Chain& chain, const FramePair& frame) {
    const bool isGl = runner.backend() == Backend::Gl;
    cv::Mat image = runner.run(chain, frame, {}).images["color"].clone();  // compiles
    Timing timing;
    double sum = 0;
    for (int k = 0; k < 3 || (k < 15 && sum < longRun * 4); k++) {
        const auto start = cv::getTickCount();
        const RunResult run = runner.run(chain, frame, {});
        const double wall = double(cv::getTickCount() - start) * 1e3 / cv::getTickFrequency();
        timing.milliseconds.push_back(isGl ? sumOf(run.timings) : wall);
        sum += wall;
    }
    result.milliseconds = timing.median();
    result.low = timing.quartileLow();
    result.high = timing.quartileHigh();
    return image;
}

}  // namespace

cv::Vec3d pictureDifference(const cv::Mat& a, const cv::Mat& b) {
    CV_Assert(a.size() == b.size() && a.type() == CV_32FC4 && b.type() == CV_32FC4);
    auto encoded = [](float x) { return 255 * srgbEncode(double(x < 0 ? 0 : x > 1 ? 1 : x)); };
    constexpr int block = 16;
    const int columns = (a.cols + block - 1) / block, rows = (a.rows + block - 1) / block;
    cv::Mat means(rows, columns, CV_64FC3, cv::Scalar()), counts(rows, columns, CV_64F, cv::Scalar());
    double worst = 0, sum = 0;
    for (int j = 0; j < a.rows; j++)
        for (int i = 0; i < a.cols; i++) {
            const auto &p = a.at<cv::Vec4f>(j, i), &q = b.at<cv::Vec4f>(j, i);
            cv::Vec3d d;
            for (int c = 0; c < 3; c++) d[c] = encoded(p[c]) - encoded(q[c]);
            const double most = std::max({std::abs(d[0]), std::abs(d[1]), std::abs(d[2])});
            worst = std::max(worst, most);
            sum += most * most;
            means.at<cv::Vec3d>(j / block, i / block) += d;
            counts.at<double>(j / block, i / block)++;
        }
    double coarse = 0;
    for (int j = 0; j < rows; j++)
        for (int i = 0; i < columns; i++) {
            const cv::Vec3d mean = means.at<cv::Vec3d>(j, i) / counts.at<double>(j, i);
            const double most = std::max({std::abs(mean[0]), std::abs(mean[1]), std::abs(mean[2])});
            coarse += most * most * counts.at<double>(j, i);
        }
    const double pixels = std::max(1., double(a.total()));
    return {worst, std::sqrt(sum / pixels), std::sqrt(coarse / pixels)};
}

std::vector<PaperResult> runPapers(const std::vector<PaperExperiment>& experiments,
                                   const std::vector<FramePair>& frames, const std::vector<Runner*>& runners,
                                   const std::function<void(const PaperResult&)>& progress) {
    std::vector<PaperResult> results;
    for (const PaperExperiment& experiment : experiments)
        for (const FramePair& captured : frames)
            for (Runner* runner : runners) {
                const size_t first = results.size();
                std::vector<cv::Mat> pictures;
                std::vector<Chain> chains;
                size_t against = size_t(-1);
                for (const auto& row : experiment.rows) {
                    PaperResult result;
                    result.paper = experiment.paper;
                    result.title = experiment.title;
                    result.measured = experiment.measured;
                    result.row = row.name;
                    result.printed = row.paper;
                    result.against = experiment.against;
                    result.backend = runner->backend() == Backend::Gl ? "gl" : "cpu";
                    result.device = deviceName(*runner);
                    result.frame = captured.name;
                    const FramePair frame = resized(captured, row.size);
                    result.size = frame.size();
                    pictures.emplace_back();
                    chains.emplace_back();
                    try {
                        chains.back() = boundTo(row.chain, frame, runner->backend());
                        pictures.back() = measure(result, *runner, chains.back(), frame);
                        if (experiment.isShown && &captured == &frames[0])
                            result.shown = middleOf(pictures.back());
                        if (row.name == experiment.against) against = pictures.size() - 1;
                    } catch (const Error& e) {
                        result.problem = e.what();
                    }
                    if (progress) progress(result);
                    results.push_back(result);
                }
                if (against == size_t(-1)) continue;
                for (size_t k = 0; k < pictures.size(); k++) {
                    if (pictures[k].size() != pictures[against].size() || pictures[k].empty()) continue;
                    const cv::Vec3d d = pictureDifference(pictures[k], pictures[against]);
                    PaperResult& result = results[first + k];
                    result.worst = d[0], result.rms = d[1], result.coarse = d[2];
                    result.hasDifference = k != against;
                }
                if (!(experiment.seconds > 0)) continue;
                const auto motions = measureMotion(chains, against, captured, *runner, experiment.seconds,
                                                   int(24 * experiment.seconds) + 1);
                for (size_t k = 0; k < motions.size(); k++) {
                    PaperResult& result = results[first + k];
                    result.change = motions[k].change;
                    result.shared = motions[k].shared;
                    result.hasMotion = true;
                    if (&captured == &frames[0]) result.shown = motions[k].strip;
                }
            }
    return results;
}

}  // namespace brume
