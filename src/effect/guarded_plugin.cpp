#include "effect/guarded_plugin.hpp"

#include "error.hpp"

namespace brume {

namespace {

template <class F>
auto guarded(const std::string& library, const std::string& function, F call) {
    try {
        return call();
    } catch (const Error&) {
        throw;
    } catch (const std::exception& error) {
        throw Error(ErrorKind::CheckFailed, text(library, ": ", function, " failed: ", error.what()));
    } catch (...) {
        throw Error(ErrorKind::CheckFailed,
                    text(library, ": ", function, " threw something that is no std::exception"));
    }
}

class GuardedPlugin final : public PluginEffect {
  public:
    GuardedPlugin(std::shared_ptr<const PluginEffect> plugin, const std::string& library)
        : plugin_(std::move(plugin)), library_(library) {}

    std::vector<std::pair<std::string, ParameterType>> bound() const override { return plugin_->bound(); }
    std::vector<std::string> derivedNames() const override { return plugin_->derivedNames(); }
    bool hasRows() const override { return plugin_->hasRows(); }
    int rowsTogether() const override { return plugin_->rowsTogether(); }
    bool hasRun() const override { return plugin_->hasRun(); }
    bool hasReference() const override { return plugin_->hasReference(); }
    bool hasPlan() const override { return plugin_->hasPlan(); }
    Params makeParams(const ParameterValues& values) const override {
        return guarded(library_, "the parameters' binding", [&] { return plugin_->makeParams(values); });
    }
    void rows(const Params& p, const CpuContext& context, cv::Range range) const override {
        guarded(library_, "rows", [&] { plugin_->rows(p, context, range); });
    }
    void run(const Params& p, const CpuContext& context) const override {
        guarded(library_, "run", [&] { plugin_->run(p, context); });
    }
    std::vector<double> derive(const std::string& name, const Params& p,
                               const DeriveContext& context) const override {
        return guarded(library_, "derive of '" + name + "'",
                       [&] { return plugin_->derive(name, p, context); });
    }
    void reference(const Params& p, const ReferenceContext& context, std::span<const cv::Point> pixels,
                   std::span<ReferencePixel> truth) const override {
        guarded(library_, "reference", [&] { plugin_->reference(p, context, pixels, truth); });
    }
    Plan plan(const Params& p, const PlanInput& input) const override {
        return guarded(library_, "plan", [&] { return plugin_->plan(p, input); });
    }

  private:
    std::shared_ptr<const PluginEffect> plugin_;
    std::string library_;
};

}  // namespace

std::shared_ptr<const PluginEffect> makePlugin(const PluginEntry& entry, const std::string& library) {
    auto plugin = guarded(library, "making the plugin",
                          [&] { return std::shared_ptr<const PluginEffect>(entry.make()); });
    return std::make_shared<GuardedPlugin>(std::move(plugin), library);
}

}  // namespace brume
