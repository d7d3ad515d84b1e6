#include "printable.hpp"

#include <cstdio>
#include <iostream>

namespace brume::host {
namespace {

/// Passes on whole lines, so that no character is torn from the one that decides its meaning.
class Lines final : public std::streambuf {
  public:
    explicit Lines(std::streambuf* to) : to_(to) {}

  private:
    int_type overflow(int_type c) override {
        line_ += traits_type::to_char_type(c);
        return line_.back() == '\n' && !passOn() ? traits_type::eof() : c;
    }
    int sync() override { return passOn() && to_->pubsync() == 0 ? 0 : -1; }
    bool passOn() {
        const std::string shown = printable(line_);
        line_.clear();
        return to_->sputn(shown.data(), std::streamsize(shown.size())) == std::streamsize(shown.size());
    }

    std::streambuf* to_;
    std::string line_;
};

std::string code(unsigned char byte) {
    char digits[5];
    std::snprintf(digits, sizeof digits, "\\x%02x", byte);
    return digits;
}

}  // namespace

std::string printable(const std::string& text) {
    std::string shown;
    for (size_t k = 0; k < text.size(); ++k) {
        const auto byte = static_cast<unsigned char>(text[k]);
        const auto next = static_cast<unsigned char>(k + 1 < text.size() ? text[k + 1] : 0);
        const bool isSpace = byte == '\n' || byte == '\t' || (byte == '\r' && next == '\n');
        const bool isC1 = byte == 0xc2 && next >= 0x80 && next < 0xa0;  // U+0080 to U+009F
        if (isC1 || (byte < 0x20 && !isSpace) || byte == 0x7f)
            shown += code(byte);
        else
            shown += text[k];
        if (isC1) shown += code(next), ++k;
    }
    return shown;
}

std::string printableLine(const std::string& text) {
    std::string line;
    for (char c : printable(text))
        line += c == '\n' || c == '\r' ? code(static_cast<unsigned char>(c)) : std::string(1, c);
    return line;
}

std::string shortened(std::string text, size_t most) {
    if (text.size() > most) text.replace(most / 2, text.size() - most, " ... ");
    return text;
}

PrintableOutput::PrintableOutput()
    : lines_(std::make_unique<Lines>(std::cout.rdbuf())), before_(std::cout.rdbuf(lines_.get())) {}

PrintableOutput::~PrintableOutput() {
    flush();
    std::cout.rdbuf(before_);
}

void PrintableOutput::flush() const { std::cout.flush(); }

}  // namespace brume::host
