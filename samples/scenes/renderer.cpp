#include "renderer.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "error.hpp"
#include "gl/functions.hpp"
#include "shaders.hpp"

namespace scenes {
namespace {

constexpr int samplesAcross = 2;        // a pixel's colour is the mean of 2×2
constexpr int largestTile = 4096;       // px a side of one render target
constexpr int nearShadowSize = 2048;    // texels
constexpr float nearShadowRadius = 34;  // m around the place the camera looks at

cv::Matx44d viewOf(const brume::Camera& camera) { return camera.worldFromCamera.inv(); }

// Reversed depth: 1 at the near plane, 0 at the far one.
cv::Matx44d projectionOf(const brume::Camera& camera, cv::Size size, double n, double f) {
    return {2 * camera.fx / size.width,
            0,
            1 - 2 * camera.cx / size.width,
            0,
            0,
            2 * camera.fy / size.height,
            2 * camera.cy / size.height - 1,
            0,
            0,
            0,
            n / (f - n),
            n * f / (f - n),
            0,
            0,
            -1,
            0};
}

// The part of the image that a tile covers, blown up to the whole viewport.
cv::Matx44d cropTo(cv::Rect tile, cv::Size size) {
    const double sx = double(size.width) / tile.width, sy = double(size.height) / tile.height;
    const double left = -1 + 2. * tile.x / size.width, top = 1 - 2. * tile.y / size.height;
    return {sx, 0, 0, -1 - sx * left, 0, sy, 0, 1 - sy * top, 0, 0, 1, 0, 0, 0, 0, 1};
}

// World to (u, v, depth, 1) of a light's parallel view of a box.
cv::Matx44d shadowMatrix(cv::Vec3d towardsLight, cv::Vec3d low, cv::Vec3d high) {
    const cv::Vec3d helper = std::abs(towardsLight[1]) < .99 ? cv::Vec3d(0, 1, 0) : cv::Vec3d(0, 0, 1);
    const cv::Vec3d right = cv::normalize(helper.cross(towardsLight)), up = towardsLight.cross(right);
    const cv::Vec3d axes[3] = {right, -up, -towardsLight};
    cv::Matx44d matrix = cv::Matx44d::eye();
    for (int k = 0; k < 3; k++) {
        double least = 1e30, most = -1e30;
        for (int corner = 0; corner < 8; corner++) {
            const cv::Vec3d p(corner & 1 ? high[0] : low[0], corner & 2 ? high[1] : low[1],
                              corner & 4 ? high[2] : low[2]);
            least = std::min(least, p.dot(axes[k]));
            most = std::max(most, p.dot(axes[k]));
        }
        for (int c = 0; c < 3; c++) matrix(k, c) = axes[k][c] / (most - least);
        matrix(k, 3) = -least / (most - least);
    }
    return matrix;
}

}  // namespace

brume::Camera cameraAt(const Scene& scene, cv::Size size, double place) {
    const View view = scene.path(place);
    brume::Camera camera = brume::Camera::withHorizontalView(size, scene.horizontalView);
    const cv::Vec3d back = cv::normalize(cv::Vec3d(view.eye - view.target));
    const cv::Vec3d right = cv::normalize(cv::Vec3d(0, 1, 0).cross(back)), up = back.cross(right);
    for (int k = 0; k < 3; k++) {
        camera.worldFromCamera(k, 0) = right[k];
        camera.worldFromCamera(k, 1) = up[k];
        camera.worldFromCamera(k, 2) = back[k];
        camera.worldFromCamera(k, 3) = view.eye[k];
    }
    return camera;
}

Renderer::Renderer(brume::GlContext& context, const Scene& scene)
    : context_(context), gl_(context.functions()), scene_(scene) {
    for (const Batch& batch : scene.batches) {
        upload(batch);
        if (!programs_.contains(batch.material)) {
            const ShaderPair shader = surfaceShader(scene, batch.material);
            programs_[batch.material] = compile(shader.vertex, shader.fragment, "surface");
        }
    }
    const ShaderPair sky = skyShader(scene), depth = depthShader();
    skyProgram_ = compile(sky.vertex, sky.fragment, "sky");
    depthProgram_ = compile(depth.vertex, depth.fragment, "depth");
    gl_.CreateVertexArrays(1, &emptyArray_);
    gl_.ClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    gl_.Enable(GL_DEPTH_TEST);
    wide_ = renderShadow(scene.shadowMin, scene.shadowMax, wideShadowSize, true);
}

Renderer::~Renderer() {
    for (const Drawable& drawable : drawables_) {
        const unsigned buffers[2] = {drawable.vertices, drawable.indices};
        gl_.DeleteBuffers(2, buffers);
        gl_.DeleteVertexArrays(1, &drawable.vertexArray);
    }
    for (const auto& [material, program] : programs_) gl_.DeleteProgram(program);
    gl_.DeleteProgram(skyProgram_);
    gl_.DeleteProgram(depthProgram_);
    gl_.DeleteVertexArrays(1, &emptyArray_);
    const unsigned textures[3] = {near_.texture, wide_.texture, mirror_};
    gl_.DeleteTextures(3, textures);
}

unsigned Renderer::compile(const std::string& vertex, const std::string& fragment, const std::string& what) {
    const unsigned program = gl_.CreateProgram();
    char log[4096] = "";
    for (auto [type, text] : {std::pair{GL_VERTEX_SHADER, &vertex}, {GL_FRAGMENT_SHADER, &fragment}}) {
        const unsigned shader = gl_.CreateShader(GLenum(type));
        const char* source = text->c_str();
        gl_.ShaderSource(shader, 1, &source, nullptr);
        gl_.CompileShader(shader);
        int ok = 0;
        gl_.GetShaderiv(shader, GL_COMPILE_STATUS, &ok);
        gl_.GetShaderInfoLog(shader, sizeof log, nullptr, log);
        if (!ok) brume::failUsage(scene_.name, ": the ", what, " shader does not compile: ", log);
        gl_.AttachShader(program, shader);
        gl_.DeleteShader(shader);
    }
    gl_.LinkProgram(program);
    int ok = 0;
    gl_.GetProgramiv(program, GL_LINK_STATUS, &ok);
    gl_.GetProgramInfoLog(program, sizeof log, nullptr, log);
    if (!ok) brume::failUsage(scene_.name, ": the ", what, " program does not link: ", log);
    return program;
}

void Renderer::upload(const Batch& batch) {
    Drawable drawable{batch.material, batch.castsShadow, 0, 0, 0, int(batch.mesh.indices.size())};
    gl_.CreateBuffers(1, &drawable.vertices);
    gl_.NamedBufferStorage(drawable.vertices, GLsizeiptr(batch.mesh.vertices.size() * sizeof(Vertex)),
                           batch.mesh.vertices.data(), 0);
    gl_.CreateBuffers(1, &drawable.indices);
    gl_.NamedBufferStorage(drawable.indices, GLsizeiptr(batch.mesh.indices.size() * sizeof(uint32_t)),
                           batch.mesh.indices.data(), 0);
    gl_.CreateVertexArrays(1, &drawable.vertexArray);
    gl_.VertexArrayVertexBuffer(drawable.vertexArray, 0, drawable.vertices, 0, sizeof(Vertex));
    gl_.VertexArrayElementBuffer(drawable.vertexArray, drawable.indices);
    const struct {
        int components;
        size_t offset;
    } attributes[] = {{3, offsetof(Vertex, position)},
                      {3, offsetof(Vertex, normal)},
                      {3, offsetof(Vertex, albedo)},
                      {1, offsetof(Vertex, occlusion)},
                      {2, offsetof(Vertex, uv)}};
    for (unsigned k = 0; k < std::size(attributes); k++) {
        gl_.EnableVertexArrayAttrib(drawable.vertexArray, k);
        gl_.VertexArrayAttribFormat(drawable.vertexArray, k, attributes[k].components, GL_FLOAT, GL_FALSE,
                                    unsigned(attributes[k].offset));
        gl_.VertexArrayAttribBinding(drawable.vertexArray, k, 0);
    }
    drawables_.push_back(drawable);
}

Renderer::Target Renderer::makeTarget(cv::Size size, bool withColor) {
    Target target;
    target.size = size;
    gl_.CreateFramebuffers(1, &target.framebuffer);
    gl_.CreateTextures(GL_TEXTURE_2D, 1, &target.depth);
    gl_.TextureStorage2D(target.depth, 1, GL_DEPTH_COMPONENT32F, size.width, size.height);
    gl_.NamedFramebufferTexture(target.framebuffer, GL_DEPTH_ATTACHMENT, target.depth, 0);
    if (withColor) {
        const int levels = 1 + int(std::log2(std::max(size.width, size.height)));
        gl_.CreateTextures(GL_TEXTURE_2D, 1, &target.color);
        gl_.TextureStorage2D(target.color, levels, GL_RGBA32F, size.width, size.height);
        gl_.NamedFramebufferTexture(target.framebuffer, GL_COLOR_ATTACHMENT0, target.color, 0);
    } else {
        gl_.NamedFramebufferDrawBuffer(target.framebuffer, GL_NONE);
        gl_.NamedFramebufferReadBuffer(target.framebuffer, GL_NONE);
    }
    if (gl_.CheckNamedFramebufferStatus(target.framebuffer, GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
        brume::failUsage(scene_.name, ": no room for a render target of ", size.width, "×", size.height);
    return target;
}

void Renderer::release(Target& target) {
    gl_.DeleteFramebuffers(1, &target.framebuffer);
    const unsigned textures[2] = {target.color, target.depth};
    gl_.DeleteTextures(2, textures);
    target = {};
}

void Renderer::set(unsigned program, const char* name, const cv::Matx44d& matrix) {
    const cv::Matx44f rounded(matrix);
    gl_.ProgramUniformMatrix4fv(program, gl_.GetUniformLocation(program, name), 1, GL_TRUE, rounded.val);
}

void Renderer::set(unsigned program, const char* name, cv::Vec3f v) {
    gl_.ProgramUniform3f(program, gl_.GetUniformLocation(program, name), v[0], v[1], v[2]);
}

void Renderer::drawDepth(const cv::Matx44d& clipFromWorld, bool shadowCasters) {
    set(depthProgram_, "clipFromWorld", clipFromWorld);
    gl_.ProgramUniform4f(depthProgram_, gl_.GetUniformLocation(depthProgram_, "clipPlane"), 0, 0, 0, 1);
    gl_.UseProgram(depthProgram_);
    for (const Drawable& drawable : drawables_) {
        if (shadowCasters && !drawable.castsShadow) continue;
        gl_.BindVertexArray(drawable.vertexArray);
        gl_.DrawElements(GL_TRIANGLES, drawable.count, GL_UNSIGNED_INT, nullptr);
    }
}

Renderer::Shadow Renderer::renderShadow(cv::Vec3f low, cv::Vec3f high, int size, bool readBack) {
    Shadow shadow;
    shadow.map.worldToShadow = shadowMatrix(scene_.sunDirection, low, high);
    Target target = makeTarget({size, size}, false);
    gl_.BindFramebuffer(GL_FRAMEBUFFER, target.framebuffer);
    gl_.Viewport(0, 0, size, size);
    const float farthest = 1;
    gl_.DepthMask(GL_TRUE);
    gl_.ClearNamedFramebufferfv(target.framebuffer, GL_DEPTH, 0, &farthest);
    gl_.DepthFunc(GL_LESS);
    const cv::Matx44d clipFromShadow(2, 0, 0, -1, 0, -2, 0, 1, 0, 0, 1, 0, 0, 0, 0, 1);
    gl_.Enable(GL_DEPTH_CLAMP);  // what stands nearer to the sun than the box still casts its shadow
    drawDepth(clipFromShadow * shadow.map.worldToShadow, true);
    gl_.Disable(GL_DEPTH_CLAMP);
    if (readBack) {
        cv::Mat upsideDown(size, size, CV_32F);
        gl_.GetTextureImage(target.depth, 0, GL_DEPTH_COMPONENT, GL_FLOAT, int(upsideDown.total() * 4),
                            upsideDown.data);
        cv::flip(upsideDown, shadow.map.depth, 0);
    }
    const float outside[4] = {1, 1, 1, 1};
    gl_.TextureParameteri(target.depth, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
    gl_.TextureParameteri(target.depth, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
    gl_.TextureParameteri(target.depth, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    gl_.TextureParameteri(target.depth, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    gl_.TextureParameteri(target.depth, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_BORDER);
    gl_.TextureParameteri(target.depth, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_BORDER);
    gl_.TextureParameterfv(target.depth, GL_TEXTURE_BORDER_COLOR, outside);
    shadow.texture = target.depth;
    target.depth = 0;
    release(target);
    return shadow;
}

void Renderer::setScene(unsigned program, const brume::Camera& camera, const cv::Matx44d& whole) {
    const Sky& sky = scene_.sky;
    set(program, "skyZenith", sky.zenith);
    set(program, "skyHorizon", sky.horizon);
    set(program, "skyGround", sky.ground);
    set(program, "skyGlow", sky.glow);
    gl_.ProgramUniform1f(program, gl_.GetUniformLocation(program, "cloudCover"), sky.clouds);
    set(program, "sunDirection", scene_.sunDirection);
    set(program, "sunColor", scene_.sunColor);
    set(program, "ambientUp", scene_.ambientUp);
    set(program, "ambientDown", scene_.ambientDown);
    set(program, "eye", cv::Vec3f(camera.eye()));
    // GL's texture rows run upward.
    const cv::Matx44d upward(1, 0, 0, 0, 0, -1, 0, 1, 0, 0, 1, 0, 0, 0, 0, 1);
    set(program, "nearShadowFromWorld", upward * near_.map.worldToShadow);
    set(program, "farShadowFromWorld", upward * wide_.map.worldToShadow);
    set(program, "clipFromWorldWhole", whole);
    const int count = int(std::min<size_t>(scene_.lights.size(), 24));
    gl_.ProgramUniform1i(program, gl_.GetUniformLocation(program, "lightCount"), count);
    for (int k = 0; k < count; k++) {
        const PointLight& light = scene_.lights[k];
        const auto element = [&](const char* array) { return brume::text(array, "[", k, "]"); };
        gl_.ProgramUniform4f(program, gl_.GetUniformLocation(program, element("lightPosition").c_str()),
                             light.position[0], light.position[1], light.position[2], light.range);
        set(program, element("lightColor").c_str(), light.color);
        set(program, element("lightAttenuation").c_str(), light.attenuation);
    }
}

void Renderer::drawColor(const Target& target, const cv::Matx44d& clipFromWorld, const cv::Matx44d& whole,
                         const brume::Camera& camera, cv::Vec4f clipPlane, bool mirrors) {
    gl_.BindFramebuffer(GL_FRAMEBUFFER, target.framebuffer);
    gl_.Viewport(0, 0, target.size.width, target.size.height);
    const float black[4] = {0, 0, 0, 1}, farthest = 0;
    gl_.DepthMask(GL_TRUE);
    gl_.ClearNamedFramebufferfv(target.framebuffer, GL_COLOR, 0, black);
    gl_.ClearNamedFramebufferfv(target.framebuffer, GL_DEPTH, 0, &farthest);
    gl_.BindTextureUnit(0, near_.texture);
    gl_.BindTextureUnit(1, wide_.texture);
    gl_.BindTextureUnit(2, mirror_);
    gl_.Enable(GL_CLIP_DISTANCE0);
    // Depth first, so that each pixel is shaded once.
    gl_.DepthFunc(GL_GREATER);
    gl_.ColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    for (int pass = 0; pass < 2; pass++) {
        if (pass == 1) {
            gl_.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
            gl_.DepthFunc(GL_GEQUAL);
        }
        for (const Drawable& drawable : drawables_) {
            const bool isMirror =
                drawable.material == Material::Water || drawable.material == Material::Asphalt;
            if (isMirror && !mirrors) continue;
            const unsigned program = pass ? programs_.at(drawable.material) : depthProgram_;
            set(program, "clipFromWorld", clipFromWorld);
            gl_.ProgramUniform4f(program, gl_.GetUniformLocation(program, "clipPlane"), clipPlane[0],
                                 clipPlane[1], clipPlane[2], clipPlane[3]);
            if (pass) setScene(program, camera, whole);
            gl_.UseProgram(program);
            gl_.BindVertexArray(drawable.vertexArray);
            gl_.DrawElements(GL_TRIANGLES, drawable.count, GL_UNSIGNED_INT, nullptr);
        }
    }
    gl_.Disable(GL_CLIP_DISTANCE0);
    setScene(skyProgram_, camera, whole);
    set(skyProgram_, "worldFromClip", clipFromWorld.inv());
    gl_.UseProgram(skyProgram_);
    gl_.BindVertexArray(emptyArray_);
    gl_.DepthMask(GL_FALSE);
    gl_.DrawArrays(GL_TRIANGLES, 0, 3);
    gl_.DepthMask(GL_TRUE);
}

Capture Renderer::capture(const brume::Camera& camera, cv::Size size) {
    const cv::Matx44d clipFromWorld =
        projectionOf(camera, size, scene_.nearPlane, scene_.farPlane) * viewOf(camera);
    const cv::Matx44d& pose = camera.worldFromCamera;
    const cv::Vec3f ahead(float(-pose(0, 2)), 0, float(-pose(2, 2)));
    const cv::Vec3f middle = cv::Vec3f(camera.eye()) + cv::normalize(ahead) * (nearShadowRadius * .8f);
    const cv::Vec3f reach(nearShadowRadius, 18, nearShadowRadius);
    gl_.DeleteTextures(1, &near_.texture);
    near_ =
        renderShadow({middle[0] - reach[0], scene_.shadowMin[1], middle[2] - reach[2]},
                     {middle[0] + reach[0], std::min(scene_.shadowMax[1], float(camera.eye()[1]) + reach[1]),
                      middle[2] + reach[2]},
                     nearShadowSize, false);

    const auto fitted = [&](cv::Size wanted) {
        return cv::Size(std::clamp(wanted.width, 1, largestTile), std::clamp(wanted.height, 1, largestTile));
    };
    gl_.DeleteTextures(1, &mirror_);
    mirror_ = 0;
    if (scene_.mirrorHeight) {
        const double h = *scene_.mirrorHeight;
        cv::Matx44d mirror = cv::Matx44d::eye();
        mirror(1, 1) = -1;
        mirror(1, 3) = 2 * h;
        brume::Camera below = camera;
        below.worldFromCamera = mirror * camera.worldFromCamera;
        Target target = makeTarget(fitted(size), true);
        drawColor(target, clipFromWorld * mirror, clipFromWorld, below, {0, 1, 0, float(-h + .5)}, false);
        gl_.GenerateTextureMipmap(target.color);
        gl_.TextureParameteri(target.color, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
        gl_.TextureParameteri(target.color, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
        gl_.TextureParameteri(target.color, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
        mirror_ = target.color;
        target.color = 0;
        release(target);
    }

    Capture result{cv::Mat(size, CV_32FC4), cv::Mat(size, CV_32F), camera};
    const int step = largestTile / samplesAcross;
    for (int y = 0; y < size.height; y += step) {
        for (int x = 0; x < size.width; x += step) {
            const cv::Rect tile(x, y, std::min(step, size.width - x), std::min(step, size.height - y));
            const cv::Matx44d clip = cropTo(tile, size) * clipFromWorld;
            Target target = makeTarget(tile.size() * samplesAcross, true);
            drawColor(target, clip, clipFromWorld, camera, {0, 0, 0, 1}, true);
            cv::Mat samples(target.size, CV_32FC4), pixels;
            gl_.GetTextureImage(target.color, 0, GL_RGBA, GL_FLOAT, int(samples.total() * 16), samples.data);
            release(target);
            cv::resize(samples, pixels, tile.size(), 0, 0, cv::INTER_AREA);
            cv::flip(pixels, result.color(tile), 0);

            target = makeTarget(tile.size(), false);
            gl_.BindFramebuffer(GL_FRAMEBUFFER, target.framebuffer);
            gl_.Viewport(0, 0, tile.width, tile.height);
            const float farthest = 0;
            gl_.ClearNamedFramebufferfv(target.framebuffer, GL_DEPTH, 0, &farthest);
            gl_.DepthFunc(GL_GREATER);
            drawDepth(clip, false);
            cv::Mat depth(tile.size(), CV_32F);
            gl_.GetTextureImage(target.depth, 0, GL_DEPTH_COMPONENT, GL_FLOAT, int(depth.total() * 4),
                                depth.data);
            release(target);
            cv::flip(depth, result.depth(tile), 0);
        }
    }
    return result;
}

}  // namespace scenes
