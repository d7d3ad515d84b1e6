// JSON from files that anybody may have written.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace brume {

constexpr int deepestJson = 64;

/// JSON, comments allowed. Throws Error (Usage) where it is nested deeper than deepestJson (copying JSON goes
/// as deep as the stack allows), says a key twice or holds a number beyond a double's range;
/// nlohmann::json::parse_error where it is no JSON.
nlohmann::json parseJson(std::string_view text);

/// JSON that may say a key twice, of which the last counts; discarded where it is too deep or no JSON.
nlohmann::json parseLooseJson(std::string_view text);

/// What was wrong, in a sentence or two, without the exception's number, which says nothing to people.
std::string reasonOf(const nlohmann::json::exception& error);

/// As JSON, keys in alphabetical order; text that is no UTF-8, such as some paths, does not stop it.
std::string shownJson(const nlohmann::json& value);

}  // namespace brume
