#include "gl/shader_source.hpp"

#include <algorithm>
#include <set>
#include <sstream>

#include "error.hpp"
#include "gl/gl_runner.hpp"
#include "gl/helper_passes.hpp"
#include "gl/isf_rewrite.hpp"
#include "gl/rows_buffer.hpp"

namespace brume {

namespace {

void checkName(const EffectHeader& header, const std::string& name) {
    if (!isGlslIdentifier(name))
        failUsage(header.path, ": '", name,
                  "' is reserved in GLSL or no identifier there; call it something else");
}

void declareParameter(std::ostream& out, const Parameter& parameter, const ParameterValues& values) {
    if (parameter.isCompiledIn()) {
        const long value = long(values.at(parameter.name).numbers.at(0));
        if (parameter.type == ParameterType::Bool)
            out << "const bool " << parameter.name << " = " << (value ? "true" : "false") << ";\n";
        else
            out << "const int " << parameter.name << " = " << value << ";\n";
        for (size_t k = 0; k < parameter.values.size(); k++)
            out << "const int " << parameter.choiceIdentifier(k) << " = " << parameter.values[k] << ";\n";
    } else if (parameter.type != ParameterType::List) {
        out << "uniform " << glslType(parameter.type) << " " << parameter.name << ";\n";
    }
}

void declareList(std::ostream& out, const Parameter& list, size_t binding) {
    out << "struct " << list.name << "_row {\n";
    for (const Parameter& field : list.fields)
        out << "    " << glslType(field.type) << " " << field.name << ";\n";
    out << "};\nlayout(std430, binding = " << binding << ") readonly buffer brume_" << list.name << " { "
        << list.name << "_row " << list.name << "[]; };\nuniform int " << list.name << "_count;\n";
}

void declareDerived(std::ostream& out, const Derived& derived, size_t binding) {
    static const std::map<Derived::Type, const char*> uniforms = {
        {Derived::Type::Float, "float"},     {Derived::Type::Int, "int"},   {Derived::Type::Vec2, "vec2"},
        {Derived::Type::Vec3, "vec3"},       {Derived::Type::Vec4, "vec4"}, {Derived::Type::Mat4, "mat4"},
        {Derived::Type::Volume, "sampler3D"}};
    if (auto type = uniforms.find(derived.type); type != uniforms.end())
        out << "uniform " << type->second << " " << derived.name << ";\n";
    else
        out << "layout(std430, binding = " << binding << ") readonly buffer brume_" << derived.name << " { "
            << (derived.type == Derived::Type::Array ? "float " : "vec4 ") << derived.name << "[]; };\n";
}

void declareImages(std::ostream& out, const EffectHeader& header) {
    std::set<std::string> names = {"depthImage"};
    for (const ImportedImage& image : header.imported) names.insert(image.name);
    for (const Pass& pass : header.passes)
        if (!pass.target.empty()) names.insert(pass.target);
    for (const Parameter& parameter : header.parameters) names.erase(parameter.name);
    for (const std::string& name : names) out << "uniform sampler2D " << name << ";\n";
}

}  // namespace

std::vector<std::string> storageBuffers(const EffectHeader& header) {
    std::vector<std::string> names;
    for (const Parameter& parameter : header.parameters)
        if (parameter.type == ParameterType::List) names.push_back(parameter.name);
    for (const Derived& derived : header.derived)
        if (derived.type == Derived::Type::Array || derived.type == Derived::Type::Vec4Array)
            names.push_back(derived.name);
    return names;
}

std::vector<ShaderText> linearPassSource(const Step& step, size_t index, bool transmittance) {
    const EffectHeader& header = step.effect->header;
    const Pass& pass = header.passes.at(index);
    const bool isOutput = pass.target.empty();
    const bool writesTransmittance = transmittance && header.writesTransmittance && isOutput;
    if (writesTransmittance && pass.compute)
        failUsage(header.path,
                  ": the output pass WRITES transmittance, so it must be a fragment pass, not COMPUTE");
    for (const Parameter& parameter : header.parameters) {
        checkName(header, parameter.name);
        for (const Parameter& field : parameter.fields) checkName(header, field.name);
    }
    for (const Derived& derived : header.derived) checkName(header, derived.name);
    for (const Pass& other : header.passes)
        if (!other.target.empty()) checkName(header, other.target);
    const ExpandedSource body = expandIncludes(*step.effect);
    const std::vector<std::string> buffers = storageBuffers(header);

    std::ostringstream out;
    out << "#version 450 core\n#line 1 " << body.files.size() << "\n";
    out << "#define PASS_" << (isOutput ? "output" : pass.target) << " 1\n";
    out << (pass.compute ? "#define BRUME_COMPUTE 1\n" : "#define BRUME_FRAGMENT 1\n");
    if (writesTransmittance) out << "#define BRUME_TRANSMITTANCE 1\n";
    if (pass.compute) {
        const int* size = pass.compute->localSize;
        out << "layout(local_size_x = " << size[0] << ", local_size_y = " << size[1]
            << ", local_size_z = " << size[2]
            << ") in;\nlayout(rgba32f, binding = 0) writeonly uniform image2D brume_target;\n";
    } else {
        out << "layout(location = 0) out vec4 brume_color;\n";
        if (writesTransmittance) out << "layout(location = 1) out vec4 brume_transmittance;\n";
    }
    out << "uniform ivec2 passSize;\nuniform int passRepeat;\n"
           "uniform ivec2 view_size;\nuniform ivec2 view_frameSize;\nuniform vec2 view_inverseFocal;\n"
           "uniform vec2 view_origin;\nuniform mat3 view_worldFromView;\nuniform vec3 view_eye;\n"
           "uniform float TIME;\nuniform int FRAMEINDEX;\nuniform uint view_seed;\n";
    declareImages(out, header);
    for (const Parameter& parameter : header.parameters) {
        declareParameter(out, parameter, step.values);
        if (parameter.type == ParameterType::List)
            declareList(out, parameter,
                        std::find(buffers.begin(), buffers.end(), parameter.name) - buffers.begin());
    }
    for (const Derived& derived : header.derived)
        declareDerived(out, derived,
                       std::find(buffers.begin(), buffers.end(), derived.name) - buffers.begin());
    out << body.text;

    if (pass.compute) return {{GL_COMPUTE_SHADER, out.str(), body.files}};
    return {{GL_VERTEX_SHADER, triangleVertexShader, {}}, {GL_FRAGMENT_SHADER, out.str(), body.files}};
}

std::vector<ShaderText> passSource(const Step& step, size_t pass, bool transmittance) {
    return step.effect->header.linear ? linearPassSource(step, pass, transmittance)
                                      : isfPassSource(step, pass);
}

std::string shaderSource(const Step& step, size_t pass) {
    return passSource(step, pass, step.effect->header.writesTransmittance).back().text;
}

}  // namespace brume
