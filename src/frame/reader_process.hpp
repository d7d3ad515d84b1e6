// Both ends of the line between brume and brume_reader.
#pragma once

#include "frame/decode.hpp"

namespace brume {

/// `decode`'s other half: in a process of its own.
Decoded decodeApart(const DecodeRequest& request);

/// brume_reader's whole work: answers requests from `line` until it closes.
void serveDecoding(int line);

}  // namespace brume
