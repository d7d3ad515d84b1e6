// Command-line options that several subcommands share.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "effect/runner.hpp"
#include "frame/read.hpp"

namespace brume::host {

/// How to read a frame, as far as the command line says.
struct FrameOptions {
    std::string depth, encoding, camera, color;
    double maxPixels = 268435456;

    void addTo(CLI::App& command);
    /// Throws Error (Usage) naming the option, its value and the nearest valid one.
    ReadOptions read() const;
};

/// --max-pixels, of every command that reads frames.
void addMaxPixels(CLI::App& command, double& maxPixels);

/// --size, "1920x1080", up to 2^26 pixels. Throws Error (Usage).
cv::Size parseSize(const std::string& size);

/// As CLI::Range, which lets NaN pass.
CLI::Validator numberIn(double least, double most);

/// --pass-seconds, which holds for the whole process: of every command that runs shaders.
void addPassSeconds(CLI::App& command);

struct BackendOption {
    std::string name = "auto";

    void addTo(CLI::App& command);
    /// Throws Error (Usage) for an unknown name.
    void validate() const;
    /// Auto takes GL where a real GPU renders, or where `chain` holds an effect without a CPU half.
    std::unique_ptr<Runner> makeRunner(const Chain& chain) const;
};

}  // namespace brume::host
