#include "gl/gl_runner.hpp"

#include <optional>

#include "error.hpp"
#include "gl/step_runner.hpp"

namespace brume {

namespace {

class GlRunner final : public Runner {
  public:
    explicit GlRunner(std::shared_ptr<GlThread> thread) : thread_(std::move(thread)) {
        description_ = thread_->describe();
        thread_->run([&](GlContext& context) {
            steps_ = std::make_unique<StepRunner>(context.functions(), context.isHardware());
        });
    }
    ~GlRunner() override {
        if (thread_->isGivenUp()) {
            steps_.release();  // which that thread may still be using
            return;
        }
        thread_->run([&](GlContext&) { steps_.reset(); });
    }

    std::string describe() const override { return description_; }
    Backend backend() const override { return Backend::Gl; }

    RunResult run(const Chain& chain, const FramePair& frame, const std::vector<std::string>& keep) override {
        RunResult result;
        thread_->run([&](GlContext& context) { result = runHere(context, chain, frame, keep); });
        return result;
    }

  private:
    RunResult runHere(GlContext& context, const Chain& chain, const FramePair& frame,
                      const std::vector<std::string>& keep) {
        // What a run that threw left behind; a lost context would answer so for ever.
        for (int k = 0; k < 16; k++) context.functions().GetError();
        TexturePool& pool = steps_->pool();
        auto uploaded = [&](const cv::Mat& image) {
            TexturePtr texture = pool.take(image.size(), image.channels() == 1 ? GL_R32F : GL_RGBA32F);
            steps_->staging().upload(*texture, image);
            return texture;
        };
        GlFrame onGpu;
        onGpu.frame = &frame;
        onGpu.depth = uploaded(frame.depth);
        for (const auto& [name, image] : frame.images) onGpu.images[name] = uploaded(image);
        onGpu.images["color"] = onGpu.images["captured"] = uploaded(frame.color);
        onGpu.transmittanceIsRead = chain.readsTransmittance(keep);
        if (onGpu.transmittanceIsRead) {
            auto& transmittance = onGpu.images["transmittance"] = pool.take(frame.size(), GL_RGBA32F);
            transmittance->fill({1, 1, 1, 1});
        }
        onGpu.timeDelta = frame.index == lastIndex_ + 1 ? frame.time - lastTime_ : 1. / 30;
        lastIndex_ = frame.index;
        lastTime_ = frame.time;

        RunResult result;
        for (const Step& step : chain.steps)
            if (step.enabled) steps_->run(step, onGpu);
        steps_->finishPasses();
        std::vector<std::string> wanted = keep;
        wanted.push_back("color");
        for (const std::string& name : wanted) {
            auto found = onGpu.images.find(name);
            if (found == onGpu.images.end()) failUsage("no step writes an image '", name, "' to keep");
            if (!result.images.count(name))
                result.images[name] = fourChannels(steps_->staging().download(*found->second, name));
        }
        result.timings = steps_->timings();
        if (const GLenum error = context.functions().GetError(); error != GL_NO_ERROR)
            throw Error(ErrorKind::CheckFailed,
                        text("OpenGL reported error 0x", std::hex, error, " on ", description_));
        onGpu = {};
        pool.trim();
        return result;
    }

    std::shared_ptr<GlThread> thread_;
    std::string description_;
    std::unique_ptr<StepRunner> steps_;
    int lastIndex_ = -2;
    double lastTime_ = 0;
};

}  // namespace

std::unique_ptr<Runner> makeGlRunner(GlPlatform platform) {
    return makeGlRunner(std::make_shared<GlThread>(platform));
}

std::unique_ptr<Runner> makeGlRunner(std::shared_ptr<GlThread> thread) {
    return std::make_unique<GlRunner>(std::move(thread));
}

}  // namespace brume
