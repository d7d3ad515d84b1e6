// OpenGL 4.5 core contexts without a window: OSMesa (software) and EGL (a real GPU where there is one), and
// the one thread that owns a context for its life.
#pragma once

#include <functional>
#include <future>
#include <memory>
#include <string>

namespace brume {

struct GlFunctions;  // gl/functions.hpp

enum class GlPlatform { Auto, Osmesa, Egl };

/// A context current on the thread that made it. Tests may make their own; programs use GlThread.
class GlContext {
  public:
    virtual ~GlContext() = default;
    virtual const GlFunctions& functions() const = 0;
    /// "OSMesa", "EGL device 0", "EGL surfaceless", or what another implementation calls itself.
    virtual std::string platform() const = 0;
    /// "OSMesa: Mesa/X.org, llvmpipe (LLVM 15.0.6, 256 bits), 4.5 (Core Profile) Mesa 22.3.6"
    std::string describe() const;
    /// False for software renderers (llvmpipe, softpipe, swrast).
    bool isHardware() const;
    /// Makes and makes current. Throws Error (Usage) saying what is missing. Auto: EGL if it reaches
    /// hardware, else OSMesa, else EGL.
    static std::unique_ptr<GlContext> create(GlPlatform platform);
};

/// Owns a context on a thread of its own; others post jobs and wait.
class GlThread {
  public:
    explicit GlThread(GlPlatform platform);
    /// Takes over a context made elsewhere: `make` runs on the new thread (a window's shared context).
    explicit GlThread(std::function<std::unique_ptr<GlContext>()> make);
    ~GlThread();
    /// Runs `job` on the context's thread and returns when done; rethrows what it throws. Throws Error
    /// (Usage) where a pass takes longer than passLimit() (gl/pass_watch.hpp); the thread is then given up
    /// for good. Safe from any thread.
    void run(const std::function<void(GlContext&)>& job);
    bool isGivenUp() const;
    std::string describe();

  private:
    [[noreturn]] void giveUp(const std::string& pass);

    struct State;
    std::shared_ptr<State> state_;  // and the thread's
};

}  // namespace brume
