#include "measure/probe.hpp"

#include <algorithm>

#include "error.hpp"
#include "gl/program.hpp"

namespace brume {

namespace {

constexpr size_t groupSize = 64, largestRun = groupSize * 65535;

std::string probeSource(const std::string& functions, const std::string& body, bool hasSecond) {
    std::string source = text("#version 450 core\n#line 1 2\nlayout(local_size_x = ", groupSize, ") in;\n");
    source +=
        "layout(std430, binding = 0) readonly buffer probe_Inputs0 { vec4 probe_inputs0[]; };\n"
        "layout(std430, binding = 1) readonly buffer probe_Inputs1 { vec4 probe_inputs1[]; };\n"
        "layout(std430, binding = 2) writeonly buffer probe_Results { vec4 probe_results[]; };\n"
        "#line 1 0\n";
    source += functions;
    source += text(
        "\n#line 1 2\nvoid main() {\n    uint probe_index = gl_GlobalInvocationID.x;\n"
        "    if (probe_index >= uint(probe_inputs0.length())) return;\n"
        "    vec4 in0 = probe_inputs0[probe_index], in1 = ",
        hasSecond ? "probe_inputs1[probe_index]" : "vec4(0.0)", ", result = vec4(0.0);\n#line 1 1\n", body,
        "\n#line 1 2\n    probe_results[probe_index] = result;\n}\n");
    return source;
}

std::vector<float> runProbe(const GlFunctions& gl, const Program& program, std::span<const float> inputs0,
                            std::span<const float> inputs1) {
    std::vector<float> result(inputs0.size());
    GLuint buffers[3] = {};
    gl.CreateBuffers(3, buffers);
    const auto bytes = GLsizeiptr(inputs0.size_bytes());
    gl.NamedBufferData(buffers[0], bytes, inputs0.data(), GL_STATIC_DRAW);
    gl.NamedBufferData(buffers[1], inputs1.empty() ? 16 : bytes, inputs1.empty() ? nullptr : inputs1.data(),
                       GL_STATIC_DRAW);
    gl.NamedBufferData(buffers[2], bytes, nullptr, GL_STREAM_READ);
    for (GLuint k = 0; k < 3; k++) gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, k, buffers[k]);
    gl.UseProgram(program.name());
    gl.DispatchCompute(GLuint((inputs0.size() / 4 + groupSize - 1) / groupSize), 1, 1);
    gl.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    gl.GetNamedBufferSubData(buffers[2], 0, bytes, result.data());
    gl.DeleteBuffers(3, buffers);
    return result;
}

}  // namespace

std::vector<float> probeGlsl(GlThread& thread, const std::string& functions, const std::string& body,
                             std::span<const float> inputs0, std::span<const float> inputs1) {
    if (inputs0.size() % 4 != 0 || (!inputs1.empty() && inputs1.size() != inputs0.size()))
        failUsage("GLSL probe: inputs of ", inputs0.size(), " and ", inputs1.size(),
                  " floats; give four floats an item, as many of the second as of the first");
    std::vector<float> results;
    thread.run([&](GlContext& context) {
        const GlFunctions& gl = context.functions();
        const Program program(gl, {{GL_COMPUTE_SHADER,
                                    probeSource(functions, body, !inputs1.empty()),
                                    {"the probe's functions", "the probe's body", "the probe"}}});
        for (size_t begin = 0; begin < inputs0.size(); begin += 4 * largestRun) {
            const size_t count = std::min(4 * largestRun, inputs0.size() - begin);
            const auto part = runProbe(gl, program, inputs0.subspan(begin, count),
                                       inputs1.empty() ? inputs1 : inputs1.subspan(begin, count));
            results.insert(results.end(), part.begin(), part.end());
        }
        if (const GLenum error = gl.GetError(); error != GL_NO_ERROR)
            throw Error(ErrorKind::CheckFailed, text("GLSL probe: OpenGL error 0x", std::hex, error));
    });
    return results;
}

}  // namespace brume
