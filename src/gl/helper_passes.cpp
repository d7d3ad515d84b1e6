#include "gl/helper_passes.hpp"

#include "error.hpp"

namespace brume {

const char* const triangleVertexShader = R"(#version 450 core
void main() {
    gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
}
)";

Canvas::Canvas(const GlFunctions& gl) : gl_(gl) {
    gl_.CreateFramebuffers(1, &framebuffer_);
    gl_.CreateVertexArrays(1, &vertexArray_);
    for (GLenum feature : {GL_DEPTH_TEST, GL_CULL_FACE, GL_SCISSOR_TEST, GL_DITHER, GL_MULTISAMPLE})
        gl_.Disable(feature);
}

Canvas::~Canvas() {
    gl_.DeleteFramebuffers(1, &framebuffer_);
    gl_.DeleteVertexArrays(1, &vertexArray_);
}

void Canvas::draw(const Program& program, const Texture& target, const Texture* second, GLenum mode,
                  int vertices) {
    const GLenum attachments[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
    gl_.NamedFramebufferTexture(framebuffer_, attachments[0], target.name(), 0);
    gl_.NamedFramebufferTexture(framebuffer_, attachments[1], second ? second->name() : 0, 0);
    gl_.NamedFramebufferDrawBuffers(framebuffer_, second ? 2 : 1, attachments);
    if (gl_.CheckNamedFramebufferStatus(framebuffer_, GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
        failUsage("OpenGL: this driver cannot draw to such images; use --backend cpu");
    gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
    gl_.Viewport(0, 0, target.size().width, target.size().height);
    gl_.Disablei(GL_BLEND, 0);
    if (second) {
        gl_.Enablei(GL_BLEND, 1);
        gl_.BlendEquationi(1, GL_FUNC_ADD);
        gl_.BlendFunci(1, GL_ZERO, GL_SRC_COLOR);
    }
    gl_.UseProgram(program.name());
    gl_.BindVertexArray(vertexArray_);
    gl_.DrawArrays(mode, 0, vertices);
    if (second) gl_.Disablei(GL_BLEND, 1);
    // Not left attached: the pool may free it.
    gl_.NamedFramebufferTexture(framebuffer_, attachments[0], 0, 0);
    gl_.NamedFramebufferTexture(framebuffer_, attachments[1], 0, 0);
    gl_.BindFramebuffer(GL_FRAMEBUFFER, 0);
}

namespace {

const char* const fragmentHead = R"(#version 450 core
uniform sampler2D image;
uniform ivec2 passSize;
layout(location = 0) out vec4 color;
ivec2 imageSize2() { return textureSize(image, 0); }
// edges replicated
vec4 at(ivec2 p) { return texelFetch(image, clamp(p, ivec2(0), imageSize2() - 1), 0); }
ivec2 pixel() { return ivec2(gl_FragCoord.xy); }
ivec2 turnedOver() { return ivec2(pixel().x, passSize.y - 1 - pixel().y); }
)";

// The place of a pixel's centre in the other image is a fraction of whole numbers, exact until the one
// division.
const char* const linearBody = R"(
void main() {
    ivec2 size = imageSize2();
    ivec2 numerator = (2 * pixel() + 1) * size - passSize;
    ivec2 denominator = 2 * passSize;
    ivec2 p = ivec2(floor(vec2(numerator) / vec2(denominator)));
    p -= ivec2(lessThan(numerator - p * denominator, ivec2(0)));
    p += ivec2(greaterThanEqual(numerator - p * denominator, denominator));
    vec2 f = vec2(numerator - p * denominator) / vec2(denominator);
    precise vec4 top = at(p) * (1.0 - f.x) + at(p + ivec2(1, 0)) * f.x;
    precise vec4 bottom = at(p + ivec2(0, 1)) * (1.0 - f.x) + at(p + ivec2(1, 1)) * f.x;
    precise vec4 mixed = top * (1.0 - f.y) + bottom * f.y;
    color = mixed;
}
)";

const char* const nearestBody = R"(
void main() { color = at((2 * pixel() + 1) * imageSize2() / (2 * passSize)); }
)";

const char* const encodeBody = R"(
void main() {
    vec4 c = at(turnedOver());
    vec3 x = max(c.rgb, 0.0);
    vec3 encoded = mix(1.055 * pow(x, vec3(1.0 / 2.4)) - 0.055, 12.92 * x, lessThanEqual(x, vec3(0.0031308)));
    color = vec4(encoded, c.a);
}
)";

const char* const decodeBody = R"(
void main() {
    vec4 c = at(turnedOver());
    vec3 x = max(c.rgb, 0.0);
    vec3 decoded = mix(pow((x + 0.055) / 1.055, vec3(2.4)), x / 12.92, lessThanEqual(x, vec3(0.04045)));
    // A NaN is the shader's own mistake, to be seen; max would hide it.
    bvec3 isNan = greaterThan(floatBitsToUint(c.rgb) & 0x7fffffffu, uvec3(0x7f800000u));
    color = vec4(mix(decoded, c.rgb, isNan), c.a);
#ifdef UNDRAWN
    if (floatBitsToUint(c.a) == UNDRAWN) color = vec4(0.0);
#endif
}
)";

}  // namespace

TexturePtr HelperPasses::run(const std::string& body, const TexturePtr& image, cv::Size size, GLenum format) {
    TexturePtr target = pool_.take(size, format);
    const Program& program = programs_.get(
        {{GL_VERTEX_SHADER, triangleVertexShader, {}}, {GL_FRAGMENT_SHADER, fragmentHead + body, {}}});
    program.set("image", 0);
    program.set("passSize", cv::Vec2i(size.width, size.height));
    gl_.BindTextureUnit(0, image->name());
    canvas_.draw(program, *target, nullptr, GL_TRIANGLES, 3);
    return target;
}

TexturePtr HelperPasses::resampleLinear(const TexturePtr& image, cv::Size size) {
    return image->size() == size ? image : run(linearBody, image, size, image->format());
}

TexturePtr HelperPasses::resampleNearest(const TexturePtr& image, cv::Size size) {
    return image->size() == size ? image : run(nearestBody, image, size, image->format());
}

TexturePtr HelperPasses::toIsf(const TexturePtr& image) {
    return run(encodeBody, image, image->size(), GL_RGBA32F);
}

TexturePtr HelperPasses::fromIsf(const TexturePtr& image, bool mayDiscard) {
    const std::string undrawn = mayDiscard ? text("#define UNDRAWN ", sentinelBits, "u\n") : "";
    return run(undrawn + decodeBody, image, image->size(), GL_RGBA32F);
}

}  // namespace brume
