// What a run did, for people and for --report.
#pragma once

#include <chrono>
#include <nlohmann/json.hpp>
#include <string>

#include "batch.hpp"

namespace brume::host {

class Report {
  public:
    /// Of a run of `chain` with that seed, on "cpu" or "gl".
    Report(const Chain& chain, uint32_t seed, const std::string& backend);
    void add(const Task& task, const Outcome& outcome);
    size_t failed() const { return failed_; }
    size_t made() const { return made_; }
    size_t upToDate() const { return upToDate_; }
    /// "60 frames in 21 s: 60 made, 2.8 frames/s, 5.9 megapixels/s".
    std::string summary() const;
    /// One object: "preset", "seed" and "backend", which all frames share; "frames" (each with its place in
    /// the whole run, so that reports of shards can be put together) and "summary". Written whole or not at
    /// all; throws Error (Io).
    void write(const std::string& path) const;

  private:
    nlohmann::ordered_json run_;
    nlohmann::ordered_json frames_ = nlohmann::ordered_json::array();
    size_t failed_ = 0, made_ = 0, upToDate_ = 0;
    double megapixels_ = 0;
    std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace brume::host
