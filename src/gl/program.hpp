// Compiled shaders, each compiled once a context; compilers' messages name the author's files and lines.
#pragma once

#include <map>
#include <memory>
#include <opencv2/core/matx.hpp>
#include <string>
#include <vector>

#include "gl/functions.hpp"

namespace brume {

/// One stage's complete text. `files[k]` is the file of source number k in its #line directives.
struct ShaderText {
    GLenum stage;
    std::string text;
    std::vector<std::string> files;
};

/// A linked program. Uniforms are set by name; names that the compiler dropped are ignored.
class Program {
  public:
    /// Throws Error (Usage): "fog.fs:12: error: ...".
    Program(const GlFunctions& gl, const std::vector<ShaderText>& stages);
    ~Program();
    Program(const Program&) = delete;
    Program& operator=(const Program&) = delete;

    GLuint name() const { return name_; }
    bool uses(const std::string& uniform) const { return uniforms_.count(uniform) > 0; }
    void set(const std::string& uniform, int value) const;
    void set(const std::string& uniform, unsigned value) const;
    void set(const std::string& uniform, float value) const;
    void set(const std::string& uniform, cv::Vec2i value) const;
    /// 1 to 4 floats.
    void set(const std::string& uniform, const float* values, size_t count) const;
    void set(const std::string& uniform, const cv::Matx33f& value) const;
    void set(const std::string& uniform, const cv::Matx44f& value) const;

  private:
    GLint location(const std::string& uniform) const;

    const GlFunctions& gl_;
    GLuint name_ = 0;
    std::map<std::string, GLint> uniforms_;
};

class ProgramCache {
  public:
    explicit ProgramCache(const GlFunctions& gl) : gl_(gl) {}
    /// Compiles at first sight of these texts; the reference stays valid as long as the cache.
    const Program& get(const std::vector<ShaderText>& stages);

  private:
    const GlFunctions& gl_;
    std::map<std::string, std::unique_ptr<Program>> programs_;
};

/// A compiler's log with source numbers replaced by file names ("0:12(5): error" and "0(12) : error" become
/// "fog.fs:12: error"); at most ten lines.
std::string mapShaderLog(const std::string& log, const std::vector<std::string>& files);

}  // namespace brume
