// What a sidecar says in JSON, said on the command line: "near=.1,far=100".
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace brume {

/// Numbers, true and false, and words; a key given twice is a list. Throws Error (Usage) beginning with
/// `where` for an item that is not key=value.
nlohmann::json keyValues(const std::string& text, const std::string& where);

}  // namespace brume
