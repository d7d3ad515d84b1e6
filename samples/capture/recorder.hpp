// Sees a program's matrices and the ends of its frames; writes every n-th frame as a pair that brume reads.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "projection.hpp"

namespace capture {

/// From the environment: BRUME_CAPTURE_DIR, _EVERY, _FIRST, _COUNT, _METRES_PER_UNIT, _KEEP_HUD, _PLANES,
/// _THEN_QUIT.
struct Settings {
    std::string folder = "captured";
    int every = 60, first = 60, count = 0;  ///< frames; count 0: no limit
    double metresPerUnit = 1;
    bool keepHud = false;
    bool thenQuit = false;            ///< end the program after `count` frames
    std::optional<Projection> given;  ///< where the program's own cannot be seen

    static Settings fromEnvironment();
};

/// One for the process; calls from several threads are serialised.
class Recorder {
  public:
    static Recorder& instance();

    /// A matrix reached OpenGL: as the fixed-function projection, or as a shader's uniform.
    void sawProjection(const float* matrix);
    void sawUniform(const float* matrix);
    /// A framebuffer or a viewport was chosen.
    void sawPlace();
    /// The back buffer is about to be shown.
    void endFrame();

  private:
    // Who drew with which camera: the projection, the part of the framebuffer it filled, and which one.
    struct Camera {
        Projection projection;
        int viewport[4];
        int framebuffer;
        double depthRange[2];
    };
    struct Snapshot {
        std::vector<uint8_t> rgb;
        std::vector<float> depth;
        int width = 0, height = 0, depthWidth = 0, depthHeight = 0;
        Camera camera;
    };
    using Place = std::array<int, 5>;  // framebuffer, viewport
    using Key = std::tuple<float, float, float, float, int, int, int>;
    struct Votes {
        int count = 0;
        Camera camera;
    };

    Recorder();
    bool isWanted() const;
    void vote(const Projection& projection);
    std::optional<Camera> chosen() const;
    void takeSnapshot();
    bool readDepth(Snapshot& snapshot, const Place& place) const;
    void write(const Snapshot& snapshot);

    std::recursive_mutex mutex_;
    Settings settings_;
    std::map<Key, Votes> votes_;        ///< of this frame
    std::set<Place> places_;            ///< drawn to in this frame, other than the window
    std::optional<Camera> lastChosen_;  ///< for programs that set their camera once
    std::optional<Snapshot> snapshot_;  ///< of this frame, before what is drawn flat over it
    bool drawnSince_ = false;           ///< a perspective was set after the snapshot
    bool complained_ = false;
    int frame_ = 0, written_ = 0;
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace capture
