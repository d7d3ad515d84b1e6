// The C++ half of an effect. A plugin binds the fields of its parameter struct to the names in its .fs header
// and offers functions; see any effects/*/*.cpp, and docs/AUTHORING.md.
//
// All functions are const and re-entrant: they may run on several threads at once and keep nothing between
// calls.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <opencv2/core/version.hpp>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "effect/kit/view.hpp"
#include "effect/parameter.hpp"
#include "effect/plan.hpp"

namespace brume {

/// fp32 values of DERIVED, by name.
using DerivedValues = std::map<std::string, std::vector<float>, std::less<>>;

/// What `rows` and `run` work on. All images of one call have the output's size, except `input` of an effect
/// whose output pass declares another size, and depth with it; other image inputs have been resampled to the
/// output's.
struct CpuContext {
    View view;
    cv::Mat input;          ///< CV_32FC4; may be the output itself in `rows`
    cv::Mat depth;          ///< CV_32F planar Z, +inf sky, never NaN
    cv::Mat output;         ///< CV_32FC4, allocated; write every pixel, never reallocate
    cv::Mat transmittance;  ///< CV_32FC4 running product to multiply into, or empty when nobody reads it
    /// The other image parameters, CV_32FC4; with RESAMPLE: false as they are, CV_32F where they have one
    /// channel.
    std::map<std::string, cv::Mat, std::less<>> images;
    const DerivedValues* derivedValues = nullptr;
    /// Of a step that reads what another has just left in the caches: row j is a row that the first of them
    /// will read from memory soon. For prefetching only: there may be no such row. Or empty.
    cv::Mat upcoming;
    /// The output is another image than the input, larger than the caches, and nobody reads these rows of it
    /// soon: they are best written past the caches, which saves reading them before.
    bool outputIsStreamed = false;

    const cv::Mat& image(std::string_view name) const { return images.find(name)->second; }
    std::span<const float> derived(std::string_view name) const { return derivedValues->find(name)->second; }
};

/// What the reference knows of a frame: the images as captured (fp32 values, exact), the camera in fp64.
struct ReferenceContext {
    Camera camera;
    cv::Size frameSize;
    cv::Mat input;  ///< CV_32FC4
    cv::Mat depth;  ///< CV_32F
    std::map<std::string, cv::Mat, std::less<>> images;
    double time = 0;
    int frameIndex = 0;
    uint32_t seed = 0;
    std::shared_ptr<const nlohmann::json> extras;

    const cv::Mat& image(std::string_view name) const { return images.find(name)->second; }
};

/// The truth at one pixel, and how well it can be known. Colour and transmittance are judged apart: an HDR
/// colour's bound says nothing about a transmittance, whose scale is always 1.
struct ReferencePixel {
    cv::Vec4d color;
    cv::Vec4d transmittance = {1, 1, 1, 1};  ///< of this effect alone
    double scale = 1;  ///< what TOLERANCE's relative bound refers to: the largest of 1, |C|, |A|
    /// Conditioning: |∂out/∂x|·4 ulp(x) of an fp32 intermediate x that no method avoids. Widens both bounds.
    double allowance = 0, transmittanceAllowance = 0;
    /// What the chosen method itself may be off by (a table's, a step count's, a truncated kernel's error),
    /// as it states it. Widens the reference's bound only: both halves run the same method.
    double methodError = 0, transmittanceMethodError = 0;
    bool ambiguous = false;  ///< a comparison within 4 ulp decides a discontinuity: counted, left out
};

/// The type-erased plugin. Written by EffectOf below, called by the runners.
class PluginEffect {
  public:
    using Params = std::shared_ptr<const void>;
    virtual ~PluginEffect() = default;
    /// The parameter names bound, in order; "list.field" for list fields. Compared with the header at load.
    virtual std::vector<std::pair<std::string, ParameterType>> bound() const = 0;
    virtual std::vector<std::string> derivedNames() const = 0;
    virtual Params makeParams(const ParameterValues& values) const = 0;
    virtual bool hasRows() const = 0;
    /// `rows` gets multiples of so many, counted from the image's top; only its last may be fewer.
    virtual int rowsTogether() const = 0;
    virtual bool hasRun() const = 0;
    virtual bool hasReference() const = 0;
    virtual bool hasPlan() const = 0;
    virtual void rows(const Params&, const CpuContext&, cv::Range) const = 0;
    virtual void run(const Params&, const CpuContext&) const = 0;
    virtual std::vector<double> derive(const std::string& name, const Params&,
                                       const DeriveContext&) const = 0;
    /// Fills truth[k] for pixels[k].
    virtual void reference(const Params&, const ReferenceContext&, std::span<const cv::Point> pixels,
                           std::span<ReferencePixel> truth) const = 0;
    virtual Plan plan(const Params&, const PlanInput&) const = 0;
};

inline constexpr uint32_t pluginInterfaceVersion = 9;

/// The one symbol a plugin exports, as `brume_plugin`.
struct PluginEntry {
    uint32_t interfaceVersion;
    const char* opencvVersion;
    PluginEffect* (*make)();
};

template <class P>
class EffectOf final : public PluginEffect {
  public:
    // Binding: P's field to the header's parameter. float, int, bool, cv::Vec2f, Vec3f (point3D, or a
    // colour's RGB), Vec4f.
    template <class F>
    EffectOf& bind(const char* name, F P::*field) {
        names_.emplace_back(name, typeOf<F>());
        setters_.push_back([name = std::string(name), field](P& p, const ParameterValues& values) {
            assign(p.*field, values.at(name));
        });
        return *this;
    }
    /// A list: `fields` is called with a RowBinder<Row> that binds Row's fields.
    template <class Row>
    class RowBinder {
      public:
        template <class F>
        RowBinder& bind(const char* name, F Row::*field) {
            names.emplace_back(name, typeOf<F>());
            setters.push_back([name = std::string(name), field](Row& row, const ParameterValues& values) {
                assign(row.*field, values.at(name));
            });
            return *this;
        }
        std::vector<std::pair<std::string, ParameterType>> names;
        std::vector<std::function<void(Row&, const ParameterValues&)>> setters;
    };
    template <class Row>
    EffectOf& list(const char* name, std::vector<Row> P::*field, void (*fields)(RowBinder<Row>&)) {
        RowBinder<Row> binder;
        fields(binder);
        names_.emplace_back(name, ParameterType::List);
        for (auto& [field_, type] : binder.names) names_.emplace_back(std::string(name) + "." + field_, type);
        setters_.push_back([name = std::string(name), field, binder](P& p, const ParameterValues& values) {
            for (const auto& rowValues : values.at(name).rows) {
                Row row{};
                for (const auto& set : binder.setters) set(row, rowValues);
                (p.*field).push_back(row);
            }
        });
        return *this;
    }

    /// Pointwise work on some rows of the output; the runner shares rows among threads and fuses neighbours.
    /// `together`: of an effect that works on tiles of so many rows, so that a pixel's last bits may hang on
    /// which others are in its tile.
    EffectOf& rows(void (*f)(const P&, const CpuContext&, cv::Range), int together = 1) {
        return rows_ = f, rowsTogether_ = together, *this;
    }
    /// Work on the whole image; threads by cv::parallel_for_, no reduction across row bands.
    EffectOf& run(void (*f)(const P&, const CpuContext&)) { return run_ = f, *this; }
    /// One name of DERIVED: fp64 numbers, rounded to fp32 once by the caller.
    EffectOf& derive(const char* name, std::vector<double> (*f)(const P&, const DeriveContext&)) {
        derive_[name] = f;
        return *this;
    }
    /// fp64 truth at one pixel, slow and obvious, sharing no code with rows or run.
    EffectOf& reference(ReferencePixel (*f)(const P&, const ReferenceContext&, cv::Point)) {
        return referencePixel_ = f, *this;
    }
    /// The same for many pixels at once, where whole images are cheaper than their pixels.
    EffectOf& referenceImage(void (*f)(const P&, const ReferenceContext&, std::span<const cv::Point>,
                                       std::span<ReferencePixel>)) {
        return referenceImage_ = f, *this;
    }
    EffectOf& plan(Plan (*f)(const P&, const PlanInput&)) { return plan_ = f, *this; }

    // PluginEffect
    std::vector<std::pair<std::string, ParameterType>> bound() const override { return names_; }
    std::vector<std::string> derivedNames() const override {
        std::vector<std::string> names;
        for (const auto& [name, f] : derive_) names.push_back(name);
        return names;
    }
    Params makeParams(const ParameterValues& values) const override {
        auto p = std::make_shared<P>();
        for (const auto& set : setters_) set(*p, values);
        return p;
    }
    bool hasRows() const override { return rows_; }
    int rowsTogether() const override { return rowsTogether_; }
    bool hasRun() const override { return run_; }
    bool hasReference() const override { return referencePixel_ || referenceImage_; }
    bool hasPlan() const override { return plan_; }
    void rows(const Params& p, const CpuContext& c, cv::Range r) const override { rows_(of(p), c, r); }
    void run(const Params& p, const CpuContext& c) const override { run_(of(p), c); }
    std::vector<double> derive(const std::string& name, const Params& p,
                               const DeriveContext& c) const override {
        return derive_.at(name)(of(p), c);
    }
    void reference(const Params& p, const ReferenceContext& c, std::span<const cv::Point> pixels,
                   std::span<ReferencePixel> truth) const override {
        if (referenceImage_) return referenceImage_(of(p), c, pixels, truth);
        for (size_t k = 0; k < pixels.size(); k++) truth[k] = referencePixel_(of(p), c, pixels[k]);
    }
    Plan plan(const Params& p, const PlanInput& input) const override { return plan_(of(p), input); }

  private:
    static const P& of(const Params& p) { return *static_cast<const P*>(p.get()); }
    template <class F>
    static constexpr ParameterType typeOf() {
        if constexpr (std::is_same_v<F, bool>)
            return ParameterType::Bool;
        else if constexpr (std::is_same_v<F, int>)
            return ParameterType::Long;
        else if constexpr (std::is_same_v<F, float>)
            return ParameterType::Float;
        else if constexpr (std::is_same_v<F, cv::Vec2f>)
            return ParameterType::Point2D;
        else if constexpr (std::is_same_v<F, cv::Vec3f>)
            return ParameterType::Point3D;
        else
            return std::is_same_v<F, cv::Vec4f> ? ParameterType::Color : throw "no such field type";
    }
    static void assign(bool& to, const ParameterValue& v) { to = v.numbers[0] != 0; }
    static void assign(int& to, const ParameterValue& v) { to = int(v.numbers[0]); }
    static void assign(float& to, const ParameterValue& v) { to = float(v.numbers[0]); }
    template <int n>
    static void assign(cv::Vec<float, n>& to, const ParameterValue& v) {
        for (int k = 0; k < n; k++) to[k] = float(v.numbers[k]);
    }

    std::vector<std::pair<std::string, ParameterType>> names_;
    std::vector<std::function<void(P&, const ParameterValues&)>> setters_;
    void (*rows_)(const P&, const CpuContext&, cv::Range) = nullptr;
    int rowsTogether_ = 1;
    void (*run_)(const P&, const CpuContext&) = nullptr;
    std::map<std::string, std::vector<double> (*)(const P&, const DeriveContext&)> derive_;
    ReferencePixel (*referencePixel_)(const P&, const ReferenceContext&, cv::Point) = nullptr;
    void (*referenceImage_)(const P&, const ReferenceContext&, std::span<const cv::Point>,
                            std::span<ReferencePixel>) = nullptr;
    Plan (*plan_)(const P&, const PlanInput&) = nullptr;
};

}  // namespace brume

/// Exports `effectOf`, an expression of type EffectOf<...>, as this plugin's effect.
#define BRUME_PLUGIN(effectOf)                                                               \
    extern "C" __attribute__((visibility("default"))) const brume::PluginEntry brume_plugin; \
    const brume::PluginEntry brume_plugin = {                                                \
        brume::pluginInterfaceVersion, CV_VERSION,                                           \
        []() -> brume::PluginEffect* { return new std::decay_t<decltype(effectOf)>(effectOf); }};
