// The small passes between effects: other sizes, and the encoding that foreign ISF files expect.
#pragma once

#include "gl/program.hpp"
#include "gl/texture.hpp"

namespace brume {

/// The vertex shader of a pass that draws one triangle (three vertices) over everything.
extern const char* const triangleVertexShader;

/// What every pass draws with: one framebuffer, one empty vertex array.
class Canvas {
  public:
    explicit Canvas(const GlFunctions& gl);
    ~Canvas();
    Canvas(const Canvas&) = delete;
    Canvas& operator=(const Canvas&) = delete;

    /// Makes `target` (and `second`, multiplied into, if not null) what is drawn to, and draws `vertices` of
    /// `mode`.
    void draw(const Program& program, const Texture& target, const Texture* second, GLenum mode,
              int vertices);

  private:
    const GlFunctions& gl_;
    GLuint framebuffer_ = 0, vertexArray_ = 0;
};

class HelperPasses {
  public:
    HelperPasses(const GlFunctions& gl, TexturePool& pool, ProgramCache& programs, Canvas& canvas)
        : gl_(gl), pool_(pool), programs_(programs), canvas_(canvas) {}

    /// Bilinear by pixel centres, edges replicated, in the texture's own format; itself if of that size. The
    /// twin of resampleLinear.
    TexturePtr resampleLinear(const TexturePtr& image, cv::Size size);
    /// The twin of resampleNearest.
    TexturePtr resampleNearest(const TexturePtr& image, cv::Size size);
    /// For foreign ISF files: rows turned over, to have the lowest first, and linear RGB to sRGB-encoded,
    /// piecewise and exact, going on above 1; negatives become 0. Alpha stays.
    TexturePtr toIsf(const TexturePtr& image);
    /// The reverse. Pixels that no shader wrote stay recognisable, or become transparent black if
    /// `mayDiscard`.
    TexturePtr fromIsf(const TexturePtr& image, bool mayDiscard);

  private:
    TexturePtr run(const std::string& body, const TexturePtr& image, cv::Size size, GLenum format);

    const GlFunctions& gl_;
    TexturePool& pool_;
    ProgramCache& programs_;
    Canvas& canvas_;
};

}  // namespace brume
