// What both backends offer: a chain applied to a frame.
#pragma once

#include <functional>
#include <map>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "effect/chain.hpp"

namespace brume {

struct StepTiming {
    std::string name;  ///< step id, or "id/pass"
    double milliseconds = 0;
};

struct RunResult {
    /// CV_32FC4 each: "color", "transmittance" if asked for, and every image kept.
    std::map<std::string, cv::Mat> images;
    std::vector<StepTiming>
        timings;  ///< wall time on the CPU (fused steps joined by +), GPU timer queries on GL
};

class Runner {
  public:
    virtual ~Runner() = default;
    virtual std::string describe() const = 0;  ///< "CPU, 2 threads", or GL vendor and renderer
    virtual Backend backend() const = 0;
    /// Runs a planned chain (no "auto" left) over a frame whose depth has been resolved. `keep` names images
    /// wanted besides "color". PERSISTENT targets live in the runner between calls. Not thread-safe: one
    /// runner, one caller at a time.
    virtual RunResult run(const Chain& chain, const FramePair& frame,
                          const std::vector<std::string>& keep) = 0;
};

// Shared by the runners, so that they cannot differ:

/// The camera constants of a step that works at `size` on this frame.
View viewFor(const FramePair& frame, cv::Size size);
DeriveContext deriveContextFor(const FramePair& frame, cv::Size size);

/// fp32 DERIVED of a step, from a cache keyed by what each comes FROM. Not thread-safe: one a runner.
class DerivedCache {
  public:
    const DerivedValues& get(const Step& step, const PluginEffect::Params& params,
                             const DeriveContext& context);

  private:
    struct Entry {
        std::map<std::string, std::string> keys;  // by derived name
        DerivedValues values;
    };
    std::map<std::string, Entry> entries_;  // by step id
};

/// Evaluates a header's size expression to a whole number of px, at least 1. Throws Error (Usage) if it is
/// not finite or absurd.
int evaluateSize(const SizeExpression& expression, const std::map<std::string, double>& variables,
                 int otherwise);

/// $WIDTH and $HEIGHT (of `size`) beside the step's own variables, and its int DERIVED.
std::map<std::string, double> passVariables(const Step& step, cv::Size size, const DerivedValues& derived);

/// The size of a step's output: its last pass's WIDTH and HEIGHT, by default its input's. A foreign ISF file
/// always fills its input's size.
cv::Size outputSize(const Step& step, cv::Size input, const DerivedValues& derived);

/// The CV_32FC4 image that a CV_32F one stands for: grey, opaque. One of four channels is given back itself.
cv::Mat fourChannels(const cv::Mat& image);

/// Nearest sample by pixel centres, in whole numbers: how depth is brought to another size.
cv::Mat resampleNearest(const cv::Mat& image, cv::Size size);

/// Bilinear by pixel centres, edges replicated: how a CV_32FC4 image is brought to another size. The place of
/// a centre is a ratio of whole numbers, so that CPU and GPU agree on it exactly.
cv::Mat resampleLinear(const cv::Mat& image, cv::Size size);

/// The same row by row. `image` is CV_32FC4 and shared; const calls may run side by side.
class LinearRows {
  public:
    /// Two rows of the image, enlarged: neighbouring rows of the result need the same. One for each thread
    /// and LinearRows.
    struct Memory {
        std::vector<float> wide[2], line;
        int row[2] = {-1, -1};
    };
    LinearRows(const cv::Mat& image, cv::Size size);
    /// Row j of the resampled image, 4 × size.width floats.
    void write(int j, float* to, Memory& memory) const;

  private:
    struct Taps {
        Taps(int from, int to);
        std::vector<int> first, second;  ///< neighbours
        std::vector<float> share;        ///< of the second
    };
    cv::Mat image_;
    Taps columns_, rows_;
    std::vector<int> runEnds_;  ///< where, along a row of the result, the neighbours change
};

}  // namespace brume
