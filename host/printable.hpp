// What a file says (its name, a label, a note) may hold codes that a terminal obeys: they are shown, not
// obeyed.
#pragma once

#include <memory>
#include <streambuf>
#include <string>

namespace brume::host {

/// Text for a terminal: control characters as \xNN; tabs and ends of lines stay.
std::string printable(const std::string& text);
/// The same where all must stay on one line, such as a comment: ends of lines are shown, too.
std::string printableLine(const std::string& text);
/// Of a text longer than that many bytes the middle is left out.
std::string shortened(std::string text, size_t most);

/// While it lives, std::cout writes all text printable.
class PrintableOutput {
  public:
    PrintableOutput();
    ~PrintableOutput();
    PrintableOutput(const PrintableOutput&) = delete;
    PrintableOutput& operator=(const PrintableOutput&) = delete;
    void flush() const;

  private:
    std::unique_ptr<std::streambuf> lines_;
    std::streambuf* before_;
};

}  // namespace brume::host
