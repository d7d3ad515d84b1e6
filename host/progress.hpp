// How far a long run is: a bar with rate and time left on a terminal, a plain line now and then otherwise.
#pragma once

#include <chrono>
#include <cstddef>
#include <string>

namespace brume::host {

class Progress {
  public:
    /// Silent where `total` is small.
    explicit Progress(size_t total);
    ~Progress();
    void step(size_t failed);
    /// A line of its own on stderr, above the bar.
    void say(const std::string& line);

  private:
    void draw(bool isLast);

    size_t total_, done_ = 0, failed_ = 0;
    bool isTerminal_, isShown_, hasBar_ = false;
    std::chrono::steady_clock::time_point begin_, lastDrawn_;
};

}  // namespace brume::host
