#include "gl/step_runner.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "error.hpp"
#include "frame/read.hpp"
#include "gl/isf_host.hpp"
#include "gl/pass_watch.hpp"
#include "gl/rows_buffer.hpp"
#include "gl/shader_source.hpp"
#include "memory.hpp"

namespace brume {

// One step with all that its passes need.
struct StepRunner::Bound {
    const Step& step;
    const EffectHeader& header;
    View view;
    cv::Size inputSize, outputSize;
    double timeDelta = 0;
    Variables variables;
    DerivedValues derived;
    std::map<std::string, TexturePtr> samplers;  // images and targets, by GLSL name
    std::map<std::string, GLuint> volumes;       // sampler3D, by GLSL name
    std::vector<GLuint> buffers;                 // by binding point
    TexturePtr output, transmittance;
    bool writesTransmittance = false;
};

StepRunner::StepRunner(const GlFunctions& gl, bool isHardware)
    : gl_(gl),
      isHardware_(isHardware),
      staging_(gl),
      pool_(gl),
      programs_(gl),
      canvas_(gl),
      helpers_(gl, pool_, programs_, canvas_) {}

StepRunner::~StepRunner() {
    for (auto& [name, table] : tables_)
        if (table.buffer) gl_.DeleteBuffers(1, &table.buffer);
    for (const PendingQuery& pending : queries_) gl_.DeleteQueries(2, pending.queries);
    for (const PendingPass& pending : pending_) gl_.DeleteSync(pending.done);
}

std::string StepRunner::persistentKey(const Step& step, const std::string& target) const {
    return step.id + '\n' + step.effect->header.path + '\n' + target;
}

cv::Size StepRunner::targetSize(const Bound& bound, const Pass& pass) {
    try {
        return {evaluateSize(pass.width, bound.variables, bound.inputSize.width),
                evaluateSize(pass.height, bound.variables, bound.inputSize.height)};
    } catch (const Error& error) {
        throw Error(error.kind(), text(bound.header.path, ": ", pass.target, ": ", error.what()));
    }
}

TexturePtr StepRunner::constant(cv::Size size, const cv::Vec4f& value) {
    TexturePtr texture = pool_.take(size, GL_RGBA32F);
    texture->fill(value);
    return texture;
}

TexturePtr StepRunner::imported(const ImportedImage& image, bool isForeign) {
    TexturePtr& texture = imported_[image.path + (isForeign ? "\nlowest row first" : "")];
    if (!texture) {
        cv::Mat rgba = isfImportedImage(image);
        if (isForeign) cv::flip(rgba, rgba, 0);
        texture = pool_.take(rgba.size(), GL_RGBA32F);
        staging_.upload(*texture, rgba);
    }
    return texture;
}

void StepRunner::run(const Step& step, GlFrame& frame) {
    const EffectHeader& header = step.effect->header;
    auto input = frame.images.find(step.input);
    if (input == frame.images.end())
        failUsage(step.id, ": reads the image '", step.input, "', which this frame does not have");
    Bound bound{
        .step = step, .header = header, .inputSize = input->second->size(), .timeDelta = frame.timeDelta};
    if (step.effect->plugin && !header.derived.empty())
        bound.derived = derived_.get(step, step.effect->plugin->makeParams(step.values),
                                     deriveContextFor(*frame.frame, bound.inputSize));
    bound.outputSize = outputSize(step, bound.inputSize, bound.derived);
    bound.view = viewFor(*frame.frame, bound.outputSize);
    bound.variables = passVariables(step, bound.inputSize, bound.derived);
    try {
        requireMemory(bound);
        bindImages(bound, frame);
        bindTables(bound);
        for (size_t pass = 0; pass < header.passes.size(); pass++) runPass(bound, pass);
    } catch (const Error& error) {  // an image that it brings along, a size that cannot be worked out
        const std::string what = error.what();
        if (what.find(header.path) != std::string::npos || what.rfind(step.id, 0) == 0 || header.linear)
            throw;
        throw Error(error.kind(), header.path + ": " + what);
    }

    const TexturePtr* output = &bound.output;
    if (!bound.output) {  // of a foreign file: its last pass shows the target that it draws
        output = &bound.samplers[header.passes.back().target];
        if (header.linear || !*output)
            failUsage(header.path,
                      ": no pass without TARGET ran, so nothing was drawn; one must, whatever WHEN says");
    }
    frame.images[step.output] =
        header.linear ? *output
                      : helpers_.resampleLinear(helpers_.fromIsf(*output, isfMayLeavePixels(*step.effect)),
                                                bound.outputSize);
}

void StepRunner::requireMemory(const Bound& bound) {
    double bytes = 0;
    for (const Pass& pass : bound.header.passes)
        if (!pass.target.empty() && (pass.when.empty() || pass.when.evaluate(bound.variables) != 0)) {
            const cv::Size size = targetSize(bound, pass);
            bytes += double(size.width) * size.height * (bound.header.linear || pass.isFloat ? 16 : 4);
        }
    if (bytes > double(machineMemory()))
        failUsage(bound.header.path, ": its passes draw ", std::ceil(bytes / (1 << 30)),
                  " GiB of images, more than this machine has memory");
}

void StepRunner::bindImages(Bound& bound, GlFrame& frame) {
    const Step& step = bound.step;
    const EffectHeader& header = bound.header;
    bound.writesTransmittance =
        header.writesTransmittance && frame.transmittanceIsRead && bound.outputSize == frame.frame->size();
    if (bound.writesTransmittance) {
        bound.transmittance = frame.images.at("transmittance");
        if (step.reads("transmittance")) {  // a pass cannot read what it multiplies into
            TexturePtr copy = pool_.take(bound.transmittance->size(), GL_RGBA32F);
            gl_.CopyImageSubData(bound.transmittance->name(), GL_TEXTURE_2D, 0, 0, 0, 0, copy->name(),
                                 GL_TEXTURE_2D, 0, 0, 0, 0, copy->size().width, copy->size().height, 1);
            bound.transmittance = copy;
        }
    }
    for (const Parameter& parameter : header.parameters) {
        TexturePtr& sampler = bound.samplers[parameter.name];
        if (parameter.type == ParameterType::Audio || parameter.type == ParameterType::AudioFft) {
            sampler = constant(isfAudioSize(parameter), isfSilence(parameter));
        } else if (parameter.type == ParameterType::Image && !header.linear &&
                   parameter.name != header.mainImage() && step.values.at(parameter.name).text.empty()) {
            sampler = constant(bound.outputSize, {0, 0, 0, 0});  // ISF's for an image that nobody gave
        } else if (parameter.type == ParameterType::Image) {
            const std::string name = step.imageOf(parameter.name);
            auto image = frame.images.find(name);
            if (image == frame.images.end())
                failUsage(step.id, ": reads the image '", name, "', which this frame does not have");
            sampler = parameter.name == header.mainImage() || !parameter.resample
                          ? image->second
                          : helpers_.resampleLinear(image->second, bound.outputSize);
            if (!header.linear) sampler = helpers_.toIsf(sampler);
        } else {
            bound.samplers.erase(parameter.name);
        }
    }
    for (const ImportedImage& image : header.imported)
        bound.samplers[image.name] = imported(image, !header.linear);
    if (header.linear) bound.samplers["depthImage"] = helpers_.resampleNearest(frame.depth, bound.inputSize);
    for (const Pass& pass : header.passes)
        if (pass.persistent && !pass.target.empty())
            if (auto kept = persistent_.find(persistentKey(step, pass.target));
                kept != persistent_.end() && kept->second->size() == targetSize(bound, pass))
                bound.samplers[pass.target] = kept->second;
    if (bound.writesTransmittance) frame.images["transmittance"] = bound.transmittance;
}

// What a texture beyond the driver's limits was to be for is said with them.
template <class Make>
static auto heldFor(const std::string& what, Make make) {
    try {
        return make();
    } catch (const Error& error) {
        throw Error(error.kind(), what + ": " + error.what());
    }
}

void StepRunner::bindTables(Bound& bound) {
    const std::vector<std::string> names = storageBuffers(bound.header);
    bound.buffers.resize(names.size());
    auto bufferOf = [&](const std::string& name, const void* data, size_t bytes) {
        TableBuffer& table = tables_[bound.step.id + '\n' + name];
        if (!table.buffer) gl_.CreateBuffers(1, &table.buffer);
        gl_.NamedBufferData(table.buffer, GLsizeiptr(bytes), data, GL_DYNAMIC_DRAW);
        bound.buffers[std::find(names.begin(), names.end(), name) - names.begin()] = table.buffer;
    };
    for (const Parameter& parameter : bound.header.parameters)
        if (parameter.type == ParameterType::List) {
            const auto bytes = packRows(parameter, bound.step.values.at(parameter.name));
            bufferOf(parameter.name, bytes.data(), bytes.size());
        }
    for (const Derived& derived : bound.header.derived) {
        const bool isVolume = derived.type == Derived::Type::Volume;
        if (!isVolume && derived.type != Derived::Type::Array && derived.type != Derived::Type::Vec4Array)
            continue;
        const std::vector<float>& values = bound.derived.find(derived.name)->second;
        TableBuffer& table = tables_[bound.step.id + '\n' + derived.name];
        if (isVolume) {
            cv::Vec3i size;
            for (int k = 0; k < 3; k++) size[k] = evaluateSize(derived.size[k], bound.variables, 1);
            if (!table.volume || table.volumeSize != size || table.values != values) {
                table.volumeSize = size;
                table.volume = heldFor(bound.header.path + ": '" + derived.name + "'",
                                       [&] { return std::make_unique<Texture>(gl_, size); });
                table.volume->upload(values);
            }
            bound.volumes[derived.name] = table.volume->name();
        } else if (!table.buffer || table.values != values) {
            std::vector<float> padded = values;  // a shader's array is never empty
            padded.resize(std::max<size_t>(values.size(), 4));
            bufferOf(derived.name, padded.data(), padded.size() * sizeof(float));
        } else {
            bound.buffers[std::find(names.begin(), names.end(), derived.name) - names.begin()] = table.buffer;
        }
        table.values = values;
    }
}

void StepRunner::runPass(Bound& bound, size_t index) {
    const Pass& pass = bound.header.passes[index];
    if (!pass.when.empty() && pass.when.evaluate(bound.variables) == 0) return;
    const bool isOutput = pass.target.empty();
    const std::string name = bound.header.passes.size() == 1
                                 ? bound.step.id
                                 : bound.step.id + "/" + (isOutput ? "output" : pass.target);
    const std::string nameWithFile = bound.header.path + ": the pass " + name;
    const PassWatch watch(nameWithFile);
    const Program& program = programs_.get(passSource(bound.step, index, bound.writesTransmittance));
    const cv::Size size = isOutput ? bound.outputSize : targetSize(bound, pass);
    // What a foreign file's last pass draws is what is seen, under whatever name.
    const bool isShown = isOutput || (index + 1 == bound.header.passes.size() && !pass.persistent);
    const GLenum format = bound.header.linear || pass.isFloat || isShown ? GL_RGBA32F : GL_RGBA8;
    // A target that is read before it was ever written is transparent black.
    auto uses = [&](const std::string& name) {
        return program.uses(bound.header.linear ? name : isfIdentifier(name));
    };
    for (const Pass& other : bound.header.passes)
        if (!other.target.empty() && !bound.samplers[other.target] && uses(other.target))
            bound.samplers[other.target] = heldFor(nameWithFile, [&] {
                return constant(targetSize(bound, other), {0, 0, 0, 0});
            });

    PendingQuery pending{name, {}};
    gl_.CreateQueries(GL_TIMESTAMP, 2, pending.queries);
    gl_.QueryCounter(pending.queries[0], GL_TIMESTAMP);
    const double repeat = pass.repeat.empty() ? 1 : pass.repeat.evaluate(bound.variables);
    if (!(repeat <= 65536))
        failUsage(bound.header.path, ": REPEAT '", pass.repeat.source(), "' gives ", repeat,
                  "; at most 65536");
    for (int k = 0; k < repeat; k++) {
        // Never drawn into what is read: every run of a pass has a target of its own.
        TexturePtr target = heldFor(nameWithFile, [&] { return pool_.take(size, format); });
        if (isOutput || pass.compute)
            target->fillWithSentinel();
        else if (!bound.header.linear)
            target->fill({0, 0, 0, 0});
        setUniforms(bound, program, k, size);
        bindSamplers(bound, program);
        if (pass.compute)
            dispatch(bound, pass, program, target);
        else
            draw(bound, program, target, isOutput);
        (isOutput ? bound.output : bound.samplers[pass.target]) = target;
    }
    gl_.QueryCounter(pending.queries[1], GL_TIMESTAMP);
    queries_.push_back(pending);
    pending_.push_back({nameWithFile, gl_.FenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0)});
    if (!isHardware_) finishPasses();  // Mesa's would block in another pass's call
    if (pass.persistent && !isOutput)
        persistent_[persistentKey(bound.step, pass.target)] = bound.samplers[pass.target];
}

void StepRunner::draw(Bound& bound, const Program& program, const TexturePtr& target, bool isOutput) {
    const Texture* transmittance =
        isOutput && bound.writesTransmittance ? bound.transmittance.get() : nullptr;
    // Foreign vertex shaders may bend what they compute at the picture's corners, so there they get four.
    const bool isQuad = !bound.header.linear;
    canvas_.draw(program, *target, transmittance, isQuad ? GL_TRIANGLE_STRIP : GL_TRIANGLES, isQuad ? 4 : 3);
}

void StepRunner::dispatch(Bound& bound, const Pass& pass, const Program& program, const TexturePtr& target) {
    const Pass::Compute& compute = *pass.compute;
    const int over[] = {evaluateSize(compute.over[0], bound.variables, target->size().width),
                        evaluateSize(compute.over[1], bound.variables, target->size().height)};
    gl_.UseProgram(program.name());
    gl_.BindImageTexture(0, target->name(), 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA32F);
    gl_.DispatchCompute((over[0] + compute.localSize[0] - 1) / compute.localSize[0],
                        (over[1] + compute.localSize[1] - 1) / compute.localSize[1], 1);
    gl_.MemoryBarrier(GL_ALL_BARRIER_BITS);
}

void StepRunner::setUniforms(const Bound& bound, const Program& program, int repeat, cv::Size target) {
    const View& view = bound.view;
    program.set("TIME", view.time);
    program.set("FRAMEINDEX", view.frameIndex);
    if (bound.header.linear) {
        program.set("passSize", cv::Vec2i(target.width, target.height));
        program.set("passRepeat", repeat);
        program.set("view_size", cv::Vec2i(view.width, view.height));
        program.set("view_frameSize", cv::Vec2i(view.frameWidth, view.frameHeight));
        program.set("view_inverseFocal", cv::Vec2f(view.inverseFx, view.inverseFy).val, 2);
        program.set("view_origin", cv::Vec2f(view.originX, view.originY).val, 2);
        program.set("view_worldFromView", view.worldFromView);
        program.set("view_eye", view.eye.val, 3);
        program.set("view_seed", view.seed);
    } else {
        isfSetUniforms(program, view, bound.timeDelta, target);
    }
    for (const Parameter& parameter : bound.header.parameters) {
        const ParameterValue& value = bound.step.values.at(parameter.name);
        const std::string name = bound.header.linear ? parameter.name : isfIdentifier(parameter.name);
        if (parameter.type == ParameterType::List) {
            program.set(name + "_count", int(value.rows.size()));
        } else if (parameter.type == ParameterType::Long || parameter.type == ParameterType::Bool ||
                   parameter.type == ParameterType::Event) {
            program.set(name, int(value.numbers.at(0)));
        } else if (componentCount(parameter.type) > 0) {
            std::vector<float> numbers(value.numbers.begin(), value.numbers.end());
            program.set(name, numbers.data(), numbers.size());
        }
    }
    for (const Derived& derived : bound.header.derived) {
        const std::vector<float>& values = bound.derived.find(derived.name)->second;
        if (derived.type == Derived::Type::Int)
            program.set(derived.name, int(values[0]));
        else if (derived.type == Derived::Type::Mat4)
            program.set(derived.name, cv::Matx44f(values.data()));
        else if (values.size() <= 4 && derived.size.empty())
            program.set(derived.name, values.data(), values.size());
    }
}

void StepRunner::bindSamplers(Bound& bound, const Program& program) {
    int unit = 0;
    auto bind = [&](const std::string& name, GLuint texture) {
        if (!program.uses(name)) return;
        gl_.BindTextureUnit(unit, texture);
        program.set(name, unit++);
    };
    for (const auto& [name, texture] : bound.samplers)
        if (texture) bind(bound.header.linear ? name : isfIdentifier(name), texture->name());
    for (const auto& [name, texture] : bound.volumes) bind(name, texture);
    for (size_t k = 0; k < bound.buffers.size(); k++)
        gl_.BindBufferBase(GL_SHADER_STORAGE_BUFFER, GLuint(k), bound.buffers[k]);
}

void StepRunner::finishPasses() {
    for (const PendingPass& pending : pending_) {
        const PassWatch watch(pending.name);
        GLenum state = GL_TIMEOUT_EXPIRED;
        while (state == GL_TIMEOUT_EXPIRED)
            state = gl_.ClientWaitSync(pending.done, GL_SYNC_FLUSH_COMMANDS_BIT, 1'000'000'000);
        gl_.DeleteSync(pending.done);
    }
    pending_.clear();
}

std::vector<StepTiming> StepRunner::timings() {
    std::vector<StepTiming> result;
    for (const PendingQuery& pending : queries_) {
        GLuint64 begin = 0, end = 0;  // ns
        gl_.GetQueryObjectui64v(pending.queries[0], GL_QUERY_RESULT, &begin);
        gl_.GetQueryObjectui64v(pending.queries[1], GL_QUERY_RESULT, &end);
        gl_.DeleteQueries(2, pending.queries);
        result.push_back({pending.name, double(end - begin) * 1e-6});
    }
    queries_.clear();
    return result;
}

}  // namespace brume
