// What an EXR's header may ask for, checked in its bytes before OpenEXR takes memory for it.
#pragma once

#include <openexr.h>

#include <string>

namespace brume {

/// Throws Error (Io) where the file has more than 256 parts or 1024 channels, or an attribute that is longer
/// than 16 MiB (each raisedBy maxPixels) or than the rest of the file. Anything else that is wrong is left
/// for OpenEXR to say.
void requireModestHeaders(const std::string& path, size_t maxPixels);

/// Throws Error (Io) where one block of rows or one tile takes more than 32 bytes for each of maxPixels.
void requireModestBlocks(exr_const_context_t file, int part, const std::string& path, size_t maxPixels);

}  // namespace brume
