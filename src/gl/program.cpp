#include "gl/program.hpp"

#include <regex>
#include <sstream>

#include "error.hpp"

namespace brume {

namespace {

const char* stageName(GLenum stage) {
    return stage == GL_VERTEX_SHADER ? "vertex" : stage == GL_COMPUTE_SHADER ? "compute" : "fragment";
}

GLuint compile(const GlFunctions& gl, const ShaderText& stage) {
    const GLuint shader = gl.CreateShader(stage.stage);
    const char* source = stage.text.c_str();
    gl.ShaderSource(shader, 1, &source, nullptr);
    gl.CompileShader(shader);
    GLint good = 0, length = 0;
    gl.GetShaderiv(shader, GL_COMPILE_STATUS, &good);
    if (good) return shader;
    gl.GetShaderiv(shader, GL_INFO_LOG_LENGTH, &length);
    std::string log(std::max(length, 1), '\0');
    gl.GetShaderInfoLog(shader, GLsizei(log.size()), &length, log.data());
    log.resize(std::max(length, 0));
    gl.DeleteShader(shader);
    failUsage(stage.files.empty() ? "shader" : stage.files[0], ": the ", stageName(stage.stage),
              " shader does not compile:\n", mapShaderLog(log, stage.files));
}

}  // namespace

std::string mapShaderLog(const std::string& log, const std::vector<std::string>& files) {
    // Mesa: "0:12(5): error"; NVIDIA: "0(12) : error"; AMD and Intel: "ERROR: 0:12: ".
    static const std::regex place(
        R"(^((?:ERROR|WARNING): )?(\d{1,9})(?::(\d+)(?:\(\d+\))?|\((\d+)\))\s*:\s*(.*)$)");
    std::istringstream lines(log);
    std::string mapped, line;
    for (int count = 0; count < 10 && std::getline(lines, line);) {
        line.resize(std::min<size_t>(line.size(), 500));  // a long one would take std::regex's stack
        std::smatch match;
        if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
        if (std::regex_match(line, match, place)) {
            const size_t file = std::stoul(match[2]);
            line = text(file < files.size() ? files[file] : "what brume declares", ":",
                        match[3].matched ? match[3].str() : match[4].str(), ": ", match[1].str(),
                        match[5].str());
        }
        mapped += (count++ ? "\n" : "") + line;
    }
    return mapped;
}

Program::Program(const GlFunctions& gl, const std::vector<ShaderText>& stages) : gl_(gl) {
    name_ = gl_.CreateProgram();
    try {
        for (const ShaderText& stage : stages) {
            const GLuint shader = compile(gl_, stage);
            gl_.AttachShader(name_, shader);
            gl_.DeleteShader(shader);  // lives on while attached
        }
        gl_.LinkProgram(name_);
        GLint good = 0;
        gl_.GetProgramiv(name_, GL_LINK_STATUS, &good);
        if (!good) {
            std::string log(4096, '\0');
            GLsizei length = 0;
            gl_.GetProgramInfoLog(name_, GLsizei(log.size()), &length, log.data());
            log.resize(length);
            const auto& files = stages.back().files;
            failUsage(files.empty() ? "shader" : files[0],
                      ": the shaders do not link: ", mapShaderLog(log, files));
        }
    } catch (...) {
        gl_.DeleteProgram(name_);
        throw;
    }
    GLint count = 0;
    gl_.GetProgramiv(name_, GL_ACTIVE_UNIFORMS, &count);
    for (GLint k = 0; k < count; k++) {
        char uniform[512];
        GLint size = 0;
        GLenum type = 0;
        gl_.GetActiveUniform(name_, k, sizeof uniform, nullptr, &size, &type, uniform);
        if (const GLint place = gl_.GetUniformLocation(name_, uniform); place >= 0)
            uniforms_[uniform] = place;
    }
}

Program::~Program() { gl_.DeleteProgram(name_); }

GLint Program::location(const std::string& uniform) const {
    auto found = uniforms_.find(uniform);
    return found == uniforms_.end() ? -1 : found->second;  // OpenGL ignores -1
}

void Program::set(const std::string& uniform, int value) const {
    gl_.ProgramUniform1i(name_, location(uniform), value);
}
void Program::set(const std::string& uniform, unsigned value) const {
    gl_.ProgramUniform1ui(name_, location(uniform), value);
}
void Program::set(const std::string& uniform, float value) const {
    gl_.ProgramUniform1f(name_, location(uniform), value);
}
void Program::set(const std::string& uniform, cv::Vec2i value) const {
    gl_.ProgramUniform2i(name_, location(uniform), value[0], value[1]);
}
void Program::set(const std::string& uniform, const float* values, size_t count) const {
    const GLint place = location(uniform);
    if (count == 1) gl_.ProgramUniform1fv(name_, place, 1, values);
    if (count == 2) gl_.ProgramUniform2fv(name_, place, 1, values);
    if (count == 3) gl_.ProgramUniform3fv(name_, place, 1, values);
    if (count == 4) gl_.ProgramUniform4fv(name_, place, 1, values);
}
void Program::set(const std::string& uniform, const cv::Matx33f& value) const {
    gl_.ProgramUniformMatrix3fv(name_, location(uniform), 1, GL_TRUE, value.val);
}
void Program::set(const std::string& uniform, const cv::Matx44f& value) const {
    gl_.ProgramUniformMatrix4fv(name_, location(uniform), 1, GL_TRUE, value.val);
}

const Program& ProgramCache::get(const std::vector<ShaderText>& stages) {
    std::string key;
    for (const ShaderText& stage : stages) key += text(stage.stage, "\n", stage.text, "\n");
    auto& program = programs_[key];
    if (!program) program = std::make_unique<Program>(gl_, stages);
    return *program;
}

}  // namespace brume
