// Where each output of a run goes.
#pragma once

#include <string>
#include <vector>

#include "sweep.hpp"

namespace brume::host {

/// One image of the chain to write beside the picture: "transmittance", with a file ending of its own.
struct Kept {
    std::string image, extension = ".exr";
};
/// "transmittance" or "depth.npy".
Kept parseKept(const std::string& argument);

/// A name's place in its folder: the same whatever links lead to the folder.
std::string placeOf(const std::string& path);
/// Throws Error (Usage) where that would overwrite a file that was read.
void requireNotRead(const std::string& output, const std::vector<std::string>& read);

class OutputNames {
  public:
    /// `out` is a folder (existing, or ending in /, or without an ending), a file, or a pattern holding
    /// {stem}, {index}, {param} (all swept values) or a swept parameter's own name. Throws Error (Usage)
    /// where several outputs would meet in one file.
    OutputNames(const std::string& out, const std::string& format, size_t frames);

    std::string of(const std::string& input, size_t index, const Variant& variant,
                   const Settings& settings) const;
    /// The folder that all outputs have in common.
    std::string folder() const;
    bool isSingleFile() const { return kind_ == Kind::File; }
    bool isFolder() const { return kind_ == Kind::Folder; }
    static std::string keptBeside(const std::string& output, const Kept& kept);

  private:
    enum class Kind { Folder, File, Pattern } kind_;
    std::string out_, format_;
};

}  // namespace brume::host
