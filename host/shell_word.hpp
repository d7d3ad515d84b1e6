// A word of a command line that people copy into a shell.
#pragma once

#include <string>

namespace brume::host {

/// `word` so that a shell takes it for one word and obeys nothing in it: in single quotes unless it is plain.
inline std::string shellWord(const std::string& word) {
    const bool isPlain =
        !word.empty() &&
        word.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-./=:,+@%") ==
            std::string::npos;
    if (isPlain) return word;
    std::string result = "'";
    for (char c : word) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return result + "'";
}

}  // namespace brume::host
