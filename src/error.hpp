// The one exception brume throws at people: a sentence they can act on, and whose fault it is.
#pragma once

#include <sstream>
#include <stdexcept>
#include <string>

namespace brume {

/// Doubles as the exit status of the program.
enum class ErrorKind {
    CheckFailed = 1,  ///< a comparison failed, or a plugin broke its contract
    Usage = 2,        ///< a wrong name, value, preset or effect file
    Io = 3,           ///< an input could not be read or an output not written
};

class Error : public std::runtime_error {
  public:
    Error(ErrorKind kind, const std::string& sentence) : std::runtime_error(sentence), kind_(kind) {}
    ErrorKind kind() const { return kind_; }

  private:
    ErrorKind kind_;
};

/// Joins anything printable into one string.
template <class... Parts>
std::string text(const Parts&... parts) {
    std::ostringstream out;
    (out << ... << parts);
    return out.str();
}

template <class... Parts>
[[noreturn]] void failUsage(const Parts&... parts) {
    throw Error(ErrorKind::Usage, text(parts...));
}

template <class... Parts>
[[noreturn]] void failIo(const Parts&... parts) {
    throw Error(ErrorKind::Io, text(parts...));
}

}  // namespace brume
