#include "recorder.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <sstream>

#include "files.hpp"
#include "real_gl.hpp"

namespace capture {
namespace {

constexpr int pureVotes = 16;  // a projection alone is worth more than one times some model's placement

double number(const char* name, double otherwise) {
    const char* value = std::getenv(name);
    return value && *value ? std::atof(value) : otherwise;
}

int getInteger(GLenum name) {
    static const auto get = real<void (*)(GLenum, GLint*)>("glGetIntegerv");
    GLint value[4] = {};
    get(name, value);
    return value[0];
}

bool isDesktopGl() {
    static const auto getString = real<const GLubyte* (*)(GLenum)>("glGetString");
    const char* version = getString ? reinterpret_cast<const char*>(getString(GL_VERSION)) : nullptr;
    return version && std::strncmp(version, "OpenGL ES", 9) != 0;
}

double lowestDepth() {
    static const auto getError = real<GLenum (*)()>("glGetError");
    static const bool knows = [] {  // GL_CLIP_DEPTH_MODE came with 4.5
        const int known = getInteger(GL_MAJOR_VERSION) * 10 + getInteger(GL_MINOR_VERSION);
        getError();
        return known >= 45;
    }();
    return knows && getInteger(GL_CLIP_DEPTH_MODE) == GL_ZERO_TO_ONE ? 0 : -1;
}

// Sets what glReadPixels depends on to plain values, and puts the program's back.
class PlainReading {
  public:
    explicit PlainReading(int framebuffer) {
        bindBuffer_ = real<decltype(bindBuffer_)>("glBindBuffer");
        bindFramebuffer_ = real<decltype(bindFramebuffer_)>("glBindFramebuffer");
        pixelStore_ = real<decltype(pixelStore_)>("glPixelStorei");
        readBuffer_ = real<decltype(readBuffer_)>("glReadBuffer");
        for (int k = 0; k < 4; k++) pack_[k] = getInteger(packNames[k]);
        buffer_ = getInteger(GL_PIXEL_PACK_BUFFER_BINDING);
        framebuffer_ = getInteger(GL_READ_FRAMEBUFFER_BINDING);
        bindBuffer_(GL_PIXEL_PACK_BUFFER, 0);
        bindFramebuffer_(GL_READ_FRAMEBUFFER, GLuint(framebuffer));
        if (framebuffer == 0) {
            attachment_ = getInteger(GL_READ_BUFFER);
            readBuffer_(GL_BACK);
        }
        for (int k = 0; k < 4; k++) pixelStore_(packNames[k], packNames[k] == GL_PACK_ALIGNMENT ? 1 : 0);
    }
    ~PlainReading() {
        for (int k = 0; k < 4; k++) pixelStore_(packNames[k], pack_[k]);
        if (attachment_) readBuffer_(GLenum(attachment_));
        bindFramebuffer_(GL_READ_FRAMEBUFFER, GLuint(framebuffer_));
        bindBuffer_(GL_PIXEL_PACK_BUFFER, GLuint(buffer_));
    }
    PlainReading(const PlainReading&) = delete;

  private:
    static constexpr GLenum packNames[4] = {GL_PACK_ALIGNMENT, GL_PACK_ROW_LENGTH, GL_PACK_SKIP_ROWS,
                                            GL_PACK_SKIP_PIXELS};
    void (*bindBuffer_)(GLenum, GLuint);
    void (*bindFramebuffer_)(GLenum, GLuint);
    void (*pixelStore_)(GLenum, GLint);
    void (*readBuffer_)(GLenum);
    int pack_[4], buffer_ = 0, framebuffer_ = 0, attachment_ = 0;
};

// OpenGL's rows run upward, a picture's downward.
template <class Value>
void turnOver(std::vector<Value>& values, int rowLength, int rows) {
    for (int j = 0; j < rows / 2; j++)
        std::swap_ranges(values.begin() + size_t(j) * rowLength, values.begin() + size_t(j + 1) * rowLength,
                         values.begin() + size_t(rows - 1 - j) * rowLength);
}

void makeFolder(const std::string& path) {
    for (size_t at = path.find('/', 1); at != std::string::npos; at = path.find('/', at + 1))
        mkdir(path.substr(0, at).c_str(), 0777);
    mkdir(path.c_str(), 0777);
}

}  // namespace

Settings Settings::fromEnvironment() {
    Settings settings;
    if (const char* folder = std::getenv("BRUME_CAPTURE_DIR"); folder && *folder) settings.folder = folder;
    settings.every = std::max(1, int(number("BRUME_CAPTURE_EVERY", settings.every)));
    settings.first = std::max(1, int(number("BRUME_CAPTURE_FIRST", settings.every)));
    settings.count = int(number("BRUME_CAPTURE_COUNT", 0));
    settings.metresPerUnit = number("BRUME_CAPTURE_METRES_PER_UNIT", 1);
    settings.keepHud = number("BRUME_CAPTURE_KEEP_HUD", 0) != 0;
    settings.thenQuit = number("BRUME_CAPTURE_THEN_QUIT", 0) != 0;
    double n = 0, f = 0, degrees = 0;
    const char* planes = std::getenv("BRUME_CAPTURE_PLANES");
    if (planes && std::sscanf(planes, "%lf,%lf,%lf", &n, &f, &degrees) == 3 && n > 0 && f > n &&
        degrees > 0) {
        Projection projection;
        projection.focalX = 1 / std::tan(degrees * 3.14159265358979323846 / 360);
        projection.nearPlane = n;
        projection.farPlane = f;
        settings.given = projection;
    }
    return settings;
}

Recorder& Recorder::instance() {
    static Recorder* recorder = new Recorder;  // outlives the program's own static objects
    return *recorder;
}

Recorder::Recorder() : settings_(Settings::fromEnvironment()) { makeFolder(settings_.folder); }

bool Recorder::isWanted() const {
    const int next = frame_ + 1;
    return next >= settings_.first && (next - settings_.first) % settings_.every == 0 &&
           (settings_.count == 0 || written_ < settings_.count);
}

void Recorder::vote(const Projection& projection) {
    static const auto getIntegers = real<void (*)(GLenum, GLint*)>("glGetIntegerv");
    static const auto getDoubles = real<void (*)(GLenum, GLdouble*)>("glGetDoublev");
    Camera camera{projection, {}, getInteger(GL_DRAW_FRAMEBUFFER_BINDING), {0, 1}};
    getIntegers(GL_VIEWPORT, camera.viewport);
    getDoubles(GL_DEPTH_RANGE, camera.depthRange);
    const Key key(float(projection.focalX), float(projection.focalY), float(projection.nearPlane),
                  float(projection.farPlane), camera.framebuffer, camera.viewport[2], camera.viewport[3]);
    Votes& votes = votes_[key];
    votes.count += projection.isPure ? pureVotes : 1;
    votes.camera = camera;
    drawnSince_ = true;
}

void Recorder::sawProjection(const float* matrix) {
    const std::lock_guard lock(mutex_);
    if (const auto projection = perspectiveOf(matrix, lowestDepth())) {
        vote(*projection);
    } else if (isOrthographic(matrix) && isWanted() && drawnSince_ && !settings_.keepHud) {
        // What follows is flat, a HUD or a menu: the scene is complete.
        takeSnapshot();
        drawnSince_ = false;
    }
}

void Recorder::sawUniform(const float* matrix) {
    const std::lock_guard lock(mutex_);
    if (!isDesktopGl()) return;
    if (const auto projection = perspectiveOf(matrix, lowestDepth())) vote(*projection);
}

std::optional<Recorder::Camera> Recorder::chosen() const {
    const Votes* best = nullptr;
    for (const auto& [key, votes] : votes_)
        if (!best || votes.count > best->count) best = &votes;
    if (best) return best->camera;
    return lastChosen_;
}

// False where it cannot be read, or holds one value all over as after a clear or a filter's rectangle.
bool Recorder::readDepth(Snapshot& snapshot, const Place& place) const {
    static const auto readPixels =
        real<void (*)(GLint, GLint, GLsizei, GLsizei, GLenum, GLenum, void*)>("glReadPixels");
    static const auto getError = real<GLenum (*)()>("glGetError");
    static const auto isFramebuffer = real<GLboolean (*)(GLuint)>("glIsFramebuffer");
    const auto [framebuffer, x, y, width, height] = place;
    // Of the window's shape, or it is a shadow map or a reflection.
    if (width < 1 || height < 1 ||
        std::abs(double(width) / height * snapshot.height / snapshot.width - 1) > .02)
        return false;
    if (framebuffer && !isFramebuffer(GLuint(framebuffer))) return false;
    snapshot.depthWidth = width;
    snapshot.depthHeight = height;
    snapshot.depth.assign(size_t(width) * height, 0);
    const PlainReading plain(framebuffer);
    while (getError() != GL_NO_ERROR) {
    }
    readPixels(x, y, width, height, GL_DEPTH_COMPONENT, GL_FLOAT, snapshot.depth.data());
    if (getError() != GL_NO_ERROR) return false;
    const auto [least, most] = std::minmax_element(snapshot.depth.begin(), snapshot.depth.end());
    return *least < *most;
}

void Recorder::sawPlace() {
    static const auto getIntegers = real<void (*)(GLenum, GLint*)>("glGetIntegerv");
    const std::lock_guard lock(mutex_);
    if (!isWanted()) return;
    Place place{getInteger(GL_DRAW_FRAMEBUFFER_BINDING)};
    getIntegers(GL_VIEWPORT, &place[1]);
    if (place[0]) places_.insert(place);
}

void Recorder::takeSnapshot() {
    static const auto getIntegers = real<void (*)(GLenum, GLint*)>("glGetIntegerv");
    static const auto readPixels =
        real<void (*)(GLint, GLint, GLsizei, GLsizei, GLenum, GLenum, void*)>("glReadPixels");
    std::optional<Camera> camera = chosen();
    if (settings_.given) {
        Camera given{*settings_.given, {}, camera ? camera->framebuffer : 0, {0, 1}};
        getIntegers(GL_VIEWPORT, given.viewport);
        given.projection.focalY =
            given.projection.focalX * given.viewport[2] / std::max(1, given.viewport[3]);
        camera = given;
    }
    if (!camera) return;

    Snapshot snapshot;
    snapshot.camera = *camera;
    int shown[4];
    std::copy(camera->viewport, camera->viewport + 4, shown);
    if (camera->framebuffer) getIntegers(GL_VIEWPORT, shown);
    snapshot.width = shown[2];
    snapshot.height = shown[3];
    if (snapshot.width < 1 || snapshot.height < 1) return;
    snapshot.rgb.resize(size_t(snapshot.width) * snapshot.height * 3);
    {
        const PlainReading plain(0);
        readPixels(shown[0], shown[1], shown[2], shown[3], GL_RGB, GL_UNSIGNED_BYTE, snapshot.rgb.data());
    }
    // The picture is what the window shows; a scene drawn into a framebuffer of its own has its depth there.
    const int* v = camera->viewport;
    std::vector<Place> places = {{camera->framebuffer, v[0], v[1], v[2], v[3]}};
    places.insert(places.end(), places_.begin(), places_.end());
    std::sort(places.begin() + 1, places.end(),
              [](const Place& a, const Place& b) { return int64_t(a[3]) * a[4] > int64_t(b[3]) * b[4]; });
    if (!std::any_of(places.begin(), places.end(),
                     [&](const Place& place) { return readDepth(snapshot, place); })) {
        if (!complained_)
            std::fprintf(
                stderr,
                "brume_capture: the program's depth cannot be read (it has none, keeps several samples a "
                "pixel in a framebuffer of its own, or draws in another shape than the window's); try with "
                "its "
                "antialiasing off\n");
        complained_ = true;
        return;
    }
    turnOver(snapshot.rgb, snapshot.width * 3, snapshot.height);
    turnOver(snapshot.depth, snapshot.depthWidth, snapshot.depthHeight);
    snapshot_ = std::move(snapshot);
}

void Recorder::endFrame() {
    const std::lock_guard lock(mutex_);
    if (isWanted() && !isDesktopGl()) {
        if (!complained_)
            std::fprintf(stderr, "brume_capture: this program uses OpenGL ES, whose depth cannot be read\n");
        complained_ = true;
    } else if (isWanted()) {
        if (drawnSince_ || !snapshot_) takeSnapshot();
        if (snapshot_) {
            write(*snapshot_);
        } else if (!complained_) {
            std::fprintf(stderr,
                         "brume_capture: no perspective projection was seen; give it with "
                         "--planes NEAR,FAR,HORIZONTAL_VIEW_DEGREES\n");
            complained_ = true;
        }
    }
    if (const auto camera = chosen()) lastChosen_ = camera;
    votes_.clear();
    places_.clear();
    snapshot_.reset();
    drawnSince_ = false;
    frame_++;
}

void Recorder::write(const Snapshot& s) {
    char name[32];
    std::snprintf(name, sizeof name, "/frame_%05d", frame_ + 1);
    const std::string stem = settings_.folder + name;
    const Projection& p = s.camera.projection;
    const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start_;
    std::ostringstream json;
    json.precision(9);
    json << "{\n \"depth\": {\"encoding\": \"device\", \"near\": " << p.nearPlane << ", \"far\": ";
    if (std::isinf(p.farPlane))
        json << "\"infinite\"";
    else
        json << p.farPlane;
    json << ", \"range\": [" << s.camera.depthRange[0] << ", " << s.camera.depthRange[1]
         << "], \"reversed\": " << (p.reversed ? "true" : "false")
         << ", \"metres_per_unit\": " << settings_.metresPerUnit << "},\n";
    json << " \"camera\": {\"fx\": " << p.focalX * s.width / 2 << ", \"fy\": " << p.focalY * s.height / 2
         << ", \"cx\": " << (1 + p.centreX) * s.width / 2 << ", \"cy\": " << (1 - p.centreY) * s.height / 2
         << "},\n";
    json << " \"color\": {\"encoding\": \"srgb\"},\n \"time\": " << time.count() << "\n}\n";
    if (writePng(stem + ".png", s.width, s.height, s.rgb) &&
        writeNpy(stem + ".depth.npy", s.depthWidth, s.depthHeight, s.depth) &&
        writeText(stem + ".json", json.str())) {
        written_++;
        std::fprintf(stderr, "brume_capture: %s.png\n", stem.c_str());
        // At once: a program's own way out may wait for somebody.
        if (settings_.thenQuit && written_ == settings_.count) _exit(0);
    }
}

}  // namespace capture
