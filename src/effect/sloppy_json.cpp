#include "effect/sloppy_json.hpp"

#include <algorithm>
#include <cctype>

#include "strict_json.hpp"

namespace brume {

namespace {

// The length of a well-formed UTF-8 sequence of more than one byte, or 0.
size_t utf8Length(const std::string& text, size_t place) {
    const auto first = static_cast<unsigned char>(text[place]);
    const size_t length = first >= 0xf0 && first < 0xf5 ? 4 : first >= 0xe0 ? 3 : first >= 0xc2 ? 2 : 0;
    if (length == 0 || first >= 0xf5 || place + length > text.size()) return 0;
    for (size_t k = 1; k < length; k++)
        if ((static_cast<unsigned char>(text[place + k]) & 0xc0) != 0x80) return 0;
    const auto second = static_cast<unsigned char>(text[place + 1]);
    const bool isOverlong = (first == 0xe0 && second < 0xa0) || (first == 0xf0 && second < 0x90);
    const bool isSurrogate = first == 0xed && second >= 0xa0, isTooLarge = first == 0xf4 && second >= 0x90;
    return isOverlong || isSurrogate || isTooLarge ? 0 : length;
}

// JSON's form of a number that has signs, zeros and endings that JSON's have not; empty if the word is none.
// By hand: std::regex takes stack for every character.
std::string numberIn(const std::string& word) {
    size_t at = 0;
    const auto isNext = [&](std::string_view any) {
        return at < word.size() && any.find(word[at]) != std::string_view::npos;
    };
    const auto takeAll = [&](std::string_view any) {
        const size_t begin = at;
        while (isNext(any)) at++;
        return word.substr(begin, at - begin);
    };
    const std::string_view digits = "0123456789";
    const std::string sign = isNext("-") ? "-" : "";
    if (isNext("+-")) at++;
    const bool beginsWithZero = !takeAll("0").empty();
    const std::string whole = takeAll(digits);
    std::string fraction, exponent;
    if (isNext(".")) {
        at++;
        fraction = takeAll(digits);
    }
    if (!beginsWithZero && whole.empty() && fraction.empty()) return "";
    if (isNext("eE")) {
        at++;
        exponent = isNext("+-") ? std::string(1, word[at++]) : "";
        const std::string power = takeAll(digits);
        if (power.empty()) return "";
        exponent = "e" + exponent + power;
    }
    if (isNext("fF")) at++;
    if (at < word.size()) return "";
    return sign + (whole.empty() ? "0" : whole) + (fraction.empty() ? "" : "." + fraction) + exponent;
}

class Repair {
  public:
    explicit Repair(const std::string& text) : text_(text) {}

    std::string run() {
        if (text_.compare(0, 3, "\xef\xbb\xbf") == 0) place_ = 3;
        while (place_ < text_.size()) step();
        while (!open_.empty()) close(open_.back());
        return result_;
    }

  private:
    enum class Last { Start, Value, Comma, Colon, Open };

    void step() {
        const char c = text_[place_];
        if (text_.compare(place_, 2, "//") == 0) {
            place_ = std::min(text_.find('\n', place_), text_.size());
        } else if (text_.compare(place_, 2, "/*") == 0) {
            const size_t end = std::min(text_.find("*/", place_ + 2), text_.size() - 2) + 2;
            for (; place_ < end; place_++) line(text_[place_]);
        } else if (c == '"' || c == '\'') {
            string(c);
        } else if (c == '{' || c == '[') {
            value();
            emit(std::string(1, c), Last::Open);
            open_ += c == '{' ? '}' : ']';
            place_ = open_.size() > deepestJson ? text_.size() : place_ + 1;  // nobody reads what is so deep
        } else if (c == '}' || c == ']') {
            // What was opened since its own bracket was never closed.
            if (open_.find(c) != std::string::npos) {
                while (open_.back() != c) close(open_.back());
                close(c);
            }
            place_++;
        } else if (c == ',' || c == ';') {
            if (last_ == Last::Colon) emit("null", Last::Value);
            if (last_ == Last::Value) last_ = Last::Comma;  // written when something follows
            place_++;
        } else if (c == ':' || c == '=') {
            if (last_ == Last::Value) emit(":", Last::Colon);
            place_++;
        } else if (std::isalnum(static_cast<unsigned char>(c)) ||
                   std::string("+-._$").find(c) != std::string::npos) {
            word();
        } else {
            line(c);
            place_++;
        }
    }

    // A comma goes between this value and one before it, whether or not the author wrote it.
    void value() {
        if (last_ == Last::Value || last_ == Last::Comma) result_ += ',';
    }
    void emit(const std::string& piece, Last last) {
        result_ += piece;
        last_ = last;
    }
    void close(char bracket) {
        if (last_ == Last::Colon) result_ += "null";
        emit(std::string(1, bracket), Last::Value);
        open_.pop_back();
    }
    void line(char c) { result_ += c == '\n' ? '\n' : ' '; }

    void string(char quote) {
        value();
        std::string lines;
        result_ += '"';
        for (place_++; place_ < text_.size() && text_[place_] != quote; place_++) {
            const char c = text_[place_];
            if (c == '\\' && place_ + 1 < text_.size()) {
                const char next = text_[place_ + 1];
                const bool isKnown = std::string("\"\\/bfnrtu").find(next) != std::string::npos;
                result_ += isKnown ? std::string("\\") + next : "\\\\";
                if (isKnown) place_++;
            } else if (c == '\n') {
                result_ += "\\n";
                lines += '\n';
            } else if (c == '\t') {
                result_ += "\\t";
            } else if (c == '"') {
                result_ += "\\\"";
            } else if (static_cast<unsigned char>(c) < 0x20) {
                result_ += ' ';
            } else if (static_cast<unsigned char>(c) < 0x80) {
                result_ += c;
            } else if (const size_t length = utf8Length(text_, place_)) {
                result_ += text_.substr(place_, length);
                place_ += length - 1;
            } else {
                result_ += '?';
            }
        }
        place_++;
        emit("\"" + lines, Last::Value);
    }

    void word() {
        const size_t begin = place_;
        while (place_ < text_.size() && (std::isalnum(static_cast<unsigned char>(text_[place_])) ||
                                         std::string("+-._$").find(text_[place_]) != std::string::npos))
            place_++;
        value();
        emit(plain(text_.substr(begin, place_ - begin)), Last::Value);
    }

    // A number or a literal in JSON's own form; any other word as a string.
    static std::string plain(const std::string& word) {
        if (const std::string number = numberIn(word); !number.empty()) return number;
        std::string lower = word;
        std::transform(lower.begin(), lower.end(), lower.begin(),
                       [](unsigned char c) { return std::tolower(c); });
        if (lower == "true" || lower == "yes") return "true";
        if (lower == "false" || lower == "no") return "false";
        if (lower == "null" || lower == "nan" || lower == "undefined") return "null";
        return '"' + word + '"';
    }

    const std::string& text_;
    size_t place_ = 0;
    std::string result_, open_;  // open_: the brackets that are still to come
    Last last_ = Last::Start;
};

}  // namespace

std::string repairJson(const std::string& text) { return Repair(text).run(); }

}  // namespace brume
