#include "progress.hpp"

#include <unistd.h>

#include <cstdio>
#include <iostream>

#include "printable.hpp"

namespace brume::host {
namespace {

using Clock = std::chrono::steady_clock;

std::string duration(double seconds) {
    char line[40];
    long s = long(seconds + .5);
    if (s < 60)
        std::snprintf(line, sizeof line, "%ld s", s);
    else if (s < 3600)
        std::snprintf(line, sizeof line, "%ld min %02ld s", s / 60, s % 60);
    else
        std::snprintf(line, sizeof line, "%ld h %02ld min", s / 3600, s / 60 % 60);
    return line;
}

}  // namespace

Progress::Progress(size_t total)
    : total_(total),
      isTerminal_(isatty(STDERR_FILENO)),
      isShown_(total > 8),
      begin_(Clock::now()),
      lastDrawn_(begin_) {}

Progress::~Progress() {
    if (hasBar_) std::cerr << "\n";
}

void Progress::step(size_t failed) {
    done_++;
    failed_ = failed;
    double sinceDrawn = std::chrono::duration<double>(Clock::now() - lastDrawn_).count();
    bool isLast = done_ == total_;
    if (isShown_ && (isLast || sinceDrawn >= (isTerminal_ ? .1 : 10))) draw(isLast);
}

void Progress::say(const std::string& line) {
    if (hasBar_) std::cerr << "\r\033[K";
    hasBar_ = false;
    std::cerr << printable(line) << "\n";
}

void Progress::draw(bool isLast) {
    lastDrawn_ = Clock::now();
    double elapsed = std::chrono::duration<double>(lastDrawn_ - begin_).count();
    double rate = elapsed > 0 ? double(done_) / elapsed : 0;
    char numbers[160];
    std::snprintf(
        numbers, sizeof numbers, "%zu of %zu, %.2f/s, %s%s", done_, total_, rate,
        isLast ? duration(elapsed).c_str() : duration(double(total_ - done_) / std::max(rate, 1e-9)).c_str(),
        isLast ? "" : " left");
    std::string line = numbers;
    if (failed_) line += ", " + std::to_string(failed_) + " failed";
    if (!isTerminal_) {
        std::cerr << line << "\n";
        return;
    }
    const size_t width = 30;
    size_t filled = width * done_ / total_;
    std::cerr << "\r\033[K[" << std::string(filled, '#') << std::string(width - filled, '.') << "] " << line
              << std::flush;
    hasBar_ = true;
}

}  // namespace brume::host
