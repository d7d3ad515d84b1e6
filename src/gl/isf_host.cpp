#include "gl/isf_host.hpp"

#include <algorithm>
#include <filesystem>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "error.hpp"
#include "file_status.hpp"
#include "frame/image_file.hpp"
#include "frame/read.hpp"
#include "gl/rows_buffer.hpp"
#include "gl/shader_source.hpp"

namespace brume {

namespace {

// The vertex shader beside `name.fs` is `name.vs`, or `name.vert`.
std::string vertexFile(const EffectHeader& header) {
    for (const char* ending : {".vs", ".vert"}) {
        std::filesystem::path path(header.path);
        path.replace_extension(ending);
        if (isFile(path)) return path.string();
    }
    return {};
}

// Declared once here, so that what an author declares again can be left out.
std::vector<std::pair<std::string, std::string>> hostUniforms(const EffectHeader& header) {
    std::vector<std::pair<std::string, std::string>> uniforms = {{"vec2", "RENDERSIZE"},
                                                                 {"float", "TIME"},
                                                                 {"float", "TIMEDELTA"},
                                                                 {"vec4", "DATE"},
                                                                 {"int", "FRAMEINDEX"}};
    std::set<std::string> seen;
    auto add = [&](const std::string& type, const std::string& name) {
        if (!name.empty() && seen.insert(name).second) uniforms.emplace_back(type, isfIdentifier(name));
    };
    for (const Parameter& parameter : header.parameters) add(glslType(parameter.type), parameter.name);
    for (const ImportedImage& image : header.imported) add("sampler2D", image.name);
    for (const Pass& pass : header.passes) add("sampler2D", pass.target);
    return uniforms;
}

// Sampling a pixel's exact centre gives that pixel, where a filter would mix in a little of its neighbours.
const char* const samplingFunctions = R"(
vec4 isf_atPixel(sampler2D image, vec2 p) {
    vec2 size = vec2(textureSize(image, 0));
    vec2 nearest = floor(p);
    if (all(lessThan(abs(p - nearest - 0.5), vec2(1.0 / 512.0))))
        return texelFetch(image, ivec2(clamp(nearest, vec2(0.0), size - 1.0)), 0);
    return textureLod(image, p / size, 0.0);
}
vec4 IMG_PIXEL(sampler2D image, vec2 p) { return isf_atPixel(image, p); }
vec4 IMG_PIXEL(sampler2D image, vec2 p, float bias) { return isf_atPixel(image, p); }
vec4 IMG_NORM_PIXEL(sampler2D image, vec2 p) { return isf_atPixel(image, p * vec2(textureSize(image, 0))); }
vec4 IMG_NORM_PIXEL(sampler2D image, vec2 p, float bias) { return IMG_NORM_PIXEL(image, p); }
vec2 IMG_SIZE(sampler2D image) { return vec2(textureSize(image, 0)); }
vec4 isf_texture2D(sampler2D image, vec2 p) { return IMG_NORM_PIXEL(image, p); }
vec4 isf_texture2D(sampler2D image, vec2 p, float bias) { return IMG_NORM_PIXEL(image, p); }
vec4 isf_texture2DLod(sampler2D image, vec2 p, float lod) { return IMG_NORM_PIXEL(image, p); }
vec4 isf_texture2DRect(sampler2D image, vec2 p) { return isf_atPixel(image, p); }
)";

// GLSL leaves the power of a negative number undefined, and llvmpipe and others make NaN of it; the compilers
// that published files were written with multiplied where the exponent is whole.
const char* const powerFunctions = R"(
float isf_pow(float x, float y) {
    if (x >= 0.0 || y != floor(y)) return pow(x, y);
    float power = pow(-x, y);
    return mod(y, 2.0) == 0.0 ? power : -power;
}
vec2 isf_pow(vec2 x, vec2 y) { return vec2(isf_pow(x.x, y.x), isf_pow(x.y, y.y)); }
vec3 isf_pow(vec3 x, vec3 y) { return vec3(isf_pow(x.xy, y.xy), isf_pow(x.z, y.z)); }
vec4 isf_pow(vec4 x, vec4 y) { return vec4(isf_pow(x.xy, y.xy), isf_pow(x.zw, y.zw)); }
)";

// 420pack lets local constants have values known only at run time, as older compilers did. brume's functions
// come before the uniforms, whose names may hide functions that they call.
// The pass is a constant, so that each compiles its own share only of what a file with ten of them holds.
std::string head(const EffectHeader& header, size_t pass, size_t ownFile) {
    std::ostringstream out;
    out << "#version 330 core\n#extension GL_ARB_shading_language_420pack : enable\n#line 1 " << ownFile
        << "\n"
        << samplingFunctions << powerFunctions;
    for (const auto& [type, name] : hostUniforms(header)) out << "uniform " << type << " " << name << ";\n";
    out << "const int PASSINDEX = " << pass << ";\n";
    return out.str();
}

// What version 1 knew of each image: its rectangle and size in px. Declared where they are used only.
std::string imageRectangles(const EffectHeader& header, const std::set<std::string>& identifiers) {
    std::string declarations;
    for (const auto& [type, name] : hostUniforms(header)) {
        if (type != "sampler2D") continue;
        const std::string size = "vec2(textureSize(" + name + ", 0))";
        const std::string written = "_" + (name.rfind("isf_n_", 0) == 0 ? name.substr(6) : name);
        if (identifiers.count(written + "_imgSize"))
            declarations += "vec2 " + written + "_imgSize = " + size + ";\n";
        if (identifiers.count(written + "_imgRect"))
            declarations += "vec4 " + written + "_imgRect = vec4(0.0, 0.0, " + size + ");\n";
        if (identifiers.count(written + "_flip"))
            declarations += "const bool " + written + "_flip = false;\n";
    }
    return declarations;
}

const char* const fragmentFunctions = R"(
vec4 IMG_THIS_PIXEL(sampler2D image) { return IMG_NORM_PIXEL(image, isf_FragNormCoord); }
vec4 IMG_THIS_NORM_PIXEL(sampler2D image) { return IMG_NORM_PIXEL(image, isf_FragNormCoord); }
)";

const char* const vertexDeclarations = R"(
out vec2 isf_FragNormCoord;
vec2 isf_corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
vec4 isf_vertex = vec4(isf_corner * RENDERSIZE, 0.0, 1.0);
vec4 isf_vertexTexCoord = vec4(isf_corner, 0.0, 1.0);
vec4 isf_vertexColor = vec4(1.0);
mat4 isf_modelView = mat4(1.0);
mat4 isf_projection = mat4(2.0 / RENDERSIZE.x, 0.0, 0.0, 0.0, 0.0, 2.0 / RENDERSIZE.y, 0.0, 0.0,
                           0.0, 0.0, 1.0, 0.0, -1.0, -1.0, 0.0, 1.0);
vec4 isf_ftransform() { return isf_projection * isf_vertex; }
void isf_vertShaderInit() {
    isf_FragNormCoord = isf_corner;
    gl_Position = isf_ftransform();
}
)";

std::set<std::string> hostNames(const EffectHeader& header) {
    std::set<std::string> names = {"isf_FragNormCoord", "vv_FragNormCoord", "PASSINDEX"};
    for (const auto& [type, name] : hostUniforms(header)) names.insert(name);
    return names;
}

// What the fragment shader takes, where no vertex shader gives it: the pixel's place, whatever it was meant
// to be.
std::string stopgapVaryings(const std::vector<IsfVarying>& taken, const std::vector<IsfVarying>& given,
                            std::string& assignments) {
    std::string declarations;
    std::set<std::string> known;
    for (const IsfVarying& varying : given) known.insert(varying.name);
    for (const IsfVarying& varying : taken) {
        // An #if may hold it twice, as `varying` and as `in`.
        if (!known.insert(varying.name).second) continue;
        declarations += "out " + varying.type + " " + varying.name + varying.array + ";\n";
        static const std::map<std::string, std::string> values = {{"float", "isf_corner.x"},
                                                                  {"vec2", "isf_corner"},
                                                                  {"vec3", "vec3(isf_corner, 0.0)"},
                                                                  {"vec4", "vec4(isf_corner, 0.0, 1.0)"},
                                                                  {"mat2", "mat2(1.0)"},
                                                                  {"mat3", "mat3(1.0)"},
                                                                  {"mat4", "mat4(1.0)"}};
        auto value = values.find(varying.type);
        if (value == values.end()) continue;
        const std::string element = varying.array.empty() ? "" : "[k]";
        if (!varying.array.empty()) assignments += "for (int k = 0; k < " + varying.name + ".length(); k++) ";
        assignments += varying.name + element + " = " + value->second + "; ";
    }
    return declarations;
}

ShaderText vertexShader(const EffectHeader& header, size_t pass, const std::string& path,
                        const IsfUses& fragment) {
    IsfUses uses;
    std::string body =
        path.empty() ? "" : rewriteIsf(readText(path, 8), IsfStage::Vertex, hostNames(header), uses);
    std::string source = head(header, pass, 1) + vertexDeclarations;
    if (uses.identifiers.count("gl_TexCoord")) source += "out vec4 isf_TexCoord[8];\n";
    std::string assignments;
    source += stopgapVaryings(fragment.varyings, uses.varyings, assignments);
    source += imageRectangles(header, uses.identifiers);
    source += "#line 1 0\n" + body + "\n#line 1 1\nvoid main() { isf_vertShaderInit(); " + assignments +
              (uses.definesMain ? "isf_main(); " : "") + "}\n";
    return {GL_VERTEX_SHADER, source, {path.empty() ? header.path : path}};
}

}  // namespace

std::vector<ShaderText> isfPassSource(const Step& step, size_t pass) {
    const EffectHeader& header = step.effect->header;
    const ExpandedSource expanded = expandIncludes(*step.effect);
    IsfUses uses;
    const std::string body = rewriteIsf(expanded.text, IsfStage::Fragment, hostNames(header), uses);
    if (!uses.definesMain) failUsage(header.path, ": its GLSL has no function main");
    const std::string vertexPath = vertexFile(header);

    std::string source = head(header, pass, expanded.files.size());
    // Without a vertex shader of its own a pixel's place is known exactly, not interpolated.
    source += vertexPath.empty() ? "vec2 isf_FragNormCoord = gl_FragCoord.xy / RENDERSIZE;\n"
                                 : "in vec2 isf_FragNormCoord;\n";
    source += uses.fragmentData
                  ? "layout(location = 0) out vec4 isf_FragData[1];\n#define isf_FragColor isf_FragData[0]\n"
                  : "layout(location = 0) out vec4 isf_FragColor;\n";
    if (uses.identifiers.count("gl_TexCoord"))
        source += vertexPath.empty() ? "#define isf_TexCoord vec4[1](vec4(isf_FragNormCoord, 0.0, 1.0))\n"
                                     : "in vec4 isf_TexCoord[8];\n";
    source += fragmentFunctions + imageRectangles(header, uses.identifiers) + body;
    source +=
        text("\n#line 1 ", expanded.files.size(), "\nvoid main() { isf_FragColor = vec4(0.0); isf_main(); ",
             uses.output.empty() ? "" : "isf_FragColor = " + uses.output + "; ", "}\n");
    return {vertexShader(header, pass, vertexPath, uses), {GL_FRAGMENT_SHADER, source, expanded.files}};
}

void isfSetUniforms(const Program& program, const View& view, double timeDelta, cv::Size target) {
    program.set("RENDERSIZE", cv::Vec2f(float(target.width), float(target.height)).val, 2);
    program.set("TIMEDELTA", float(timeDelta));
    program.set("DATE", cv::Vec4f(2000, 1, 1, view.time).val, 4);
}

cv::Size isfAudioSize(const Parameter& parameter) {
    return {parameter.type == ParameterType::AudioFft ? 256 : 512, 1};
}

cv::Vec4f isfSilence(const Parameter& parameter) {
    return parameter.type == ParameterType::AudioFft ? cv::Vec4f(0, 0, 0, 1) : cv::Vec4f(.5f, .5f, .5f, 1);
}

cv::Mat isfImportedImage(const ImportedImage& image) {
    const cv::Mat stored = readImage(image.path);
    static const int conversions[] = {-1, cv::COLOR_GRAY2RGBA, -1, cv::COLOR_RGB2RGBA, -1};
    if (stored.channels() == 4) return stored;
    cv::Mat rgba;
    if (stored.channels() == 2) {  // grey and alpha
        cv::Mat from[] = {stored};
        rgba.create(stored.size(), CV_32FC4);
        const int pairs[] = {0, 0, 0, 1, 0, 2, 1, 3};
        cv::mixChannels(from, 1, &rgba, 1, pairs, 4);
    } else {
        cv::cvtColor(stored, rgba, conversions[stored.channels()]);
    }
    return rgba;
}

bool isfMayLeavePixels(const Effect& effect) {
    return effect.header.body.find("discard") != std::string::npos || !vertexFile(effect.header).empty();
}

}  // namespace brume
