// Runs one step's passes on the GPU.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "effect/runner.hpp"
#include "gl/helper_passes.hpp"
#include "gl/program.hpp"
#include "gl/staging.hpp"
#include "gl/texture.hpp"

namespace brume {

/// A frame on its way through a chain.
struct GlFrame {
    const FramePair* frame = nullptr;
    std::map<std::string, TexturePtr> images;  ///< by name, as in Runner
    TexturePtr depth;
    bool transmittanceIsRead = false;
    double timeDelta = 0;  ///< s since the frame before
};

/// Keeps what outlives a frame: programs, PERSISTENT targets, DERIVED. Lives and dies on its context's
/// thread.
class StepRunner {
  public:
    StepRunner(const GlFunctions& gl, bool isHardware);
    ~StepRunner();
    StepRunner(const StepRunner&) = delete;
    StepRunner& operator=(const StepRunner&) = delete;

    /// Runs the step and puts its output among `frame.images`. Throws Error naming the step or the effect
    /// file.
    void run(const Step& step, GlFrame& frame);

    /// Waits for each pass in turn, under a PassWatch of its name.
    void finishPasses();

    /// Waits for the GPU; what each pass since the last call took.
    std::vector<StepTiming> timings();

    TexturePool& pool() { return pool_; }
    Staging& staging() { return staging_; }

  private:
    struct Bound;
    struct TableBuffer {
        std::vector<float> values;
        GLuint buffer = 0;
        std::unique_ptr<Texture> volume;
        cv::Vec3i volumeSize;
    };
    using Variables = std::map<std::string, double>;

    static void requireMemory(const Bound& bound);
    void bindImages(Bound& bound, GlFrame& frame);
    void bindTables(Bound& bound);
    void runPass(Bound& bound, size_t index);
    void draw(Bound& bound, const Program& program, const TexturePtr& target, bool isOutput);
    void dispatch(Bound& bound, const Pass& pass, const Program& program, const TexturePtr& target);
    void setUniforms(const Bound& bound, const Program& program, int repeat, cv::Size target);
    void bindSamplers(Bound& bound, const Program& program);
    static cv::Size targetSize(const Bound& bound, const Pass& pass);
    TexturePtr constant(cv::Size size, const cv::Vec4f& value);
    TexturePtr imported(const ImportedImage& image, bool isForeign);
    std::string persistentKey(const Step& step, const std::string& target) const;

    const GlFunctions& gl_;
    const bool isHardware_;
    Staging staging_;
    TexturePool pool_;
    ProgramCache programs_;
    Canvas canvas_;
    HelperPasses helpers_;
    DerivedCache derived_;
    std::map<std::string, TableBuffer> tables_;     // by step id and name
    std::map<std::string, TexturePtr> persistent_;  // by step id, effect and target
    std::map<std::string, TexturePtr> imported_;    // by path
    struct PendingQuery {
        std::string name;
        GLuint queries[2];  // timestamps before and after: llvmpipe miscounts GL_TIME_ELAPSED at first use
    };
    std::vector<PendingQuery> queries_;
    struct PendingPass {
        std::string name;
        GLsync done;
    };
    std::vector<PendingPass> pending_;
};

}  // namespace brume
