// The JSON of published ISF files is often not quite JSON.
#pragma once

#include <string>

namespace brume {

/// What the text evidently means, as JSON: strings with raw line ends, tabs, unknown escapes or bytes that
/// are no UTF-8; commas missing, doubled or trailing; brackets never closed; numbers like .5, 1., +1, 1.0f;
/// words without quotes. Lines keep their numbers. What cannot be understood stays wrong, and the parser says
/// so.
std::string repairJson(const std::string& text);

}  // namespace brume
