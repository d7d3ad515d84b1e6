#include "strict_json.hpp"

#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "error.hpp"

namespace brume {

using nlohmann::json;

namespace {

// Reads without keeping anything. (The library's own callback does as well, but then goes through an array
// once for each of its objects.)
class Checks final : public json::json_sax_t {
  public:
    explicit Checks(bool mayRepeatKeys) : mayRepeatKeys_(mayRepeatKeys) {}

    bool null() override { return true; }
    bool boolean(bool) override { return true; }
    bool number_integer(number_integer_t) override { return true; }
    bool number_unsigned(number_unsigned_t) override { return true; }
    bool number_float(number_float_t, const string_t&) override { return true; }
    bool string(string_t&) override { return true; }
    bool binary(binary_t&) override { return true; }
    bool start_object(size_t) override { return open(); }
    bool end_object() override { return close(); }
    bool start_array(size_t) override { return open(); }
    bool end_array() override { return close(); }
    bool key(string_t& name) override {
        if (!mayRepeatKeys_ && !keys_.back().insert(name).second) failUsage("says \"", name, "\" twice");
        return true;
    }
    bool parse_error(size_t, const std::string&, const json::exception&) override {
        return false;  // json::parse will say it
    }

  private:
    bool open() {
        if (keys_.size() == deepestJson) failUsage("is nested deeper than ", deepestJson, " brackets");
        keys_.emplace_back();
        return true;
    }
    bool close() {
        keys_.pop_back();
        return true;
    }
    bool mayRepeatKeys_;
    std::vector<std::set<std::string>> keys_;  // of each object that is open
};

// A sentence's beginning and end: the library repeats the whole token that it could not read, a file's worth
// of line ends too.
std::string shortened(const std::string& sentence) {
    constexpr size_t most = 400;
    if (sentence.size() <= most) return sentence;
    auto isWithin = [&](size_t at) { return (static_cast<unsigned char>(sentence[at]) & 0xc0) == 0x80; };
    size_t head = most / 2, tail = sentence.size() - most / 2;  // between characters
    while (isWithin(head)) head--;
    while (tail < sentence.size() && isWithin(tail)) tail++;
    return sentence.substr(0, head) + " ... " + sentence.substr(tail);
}

}  // namespace

json parseJson(std::string_view text) {
    Checks checks(false);
    json::sax_parse(text.begin(), text.end(), &checks, json::input_format_t::json, true, true);
    try {
        return json::parse(text.begin(), text.end(), nullptr, true, true);
    } catch (const json::out_of_range& e) {
        failUsage("holds a number that no double can hold: ", reasonOf(e));
    }
}

json parseLooseJson(std::string_view text) {
    Checks checks(true);
    try {
        json::sax_parse(text.begin(), text.end(), &checks, json::input_format_t::json, true, true);
    } catch (const Error&) {
        return json::value_t::discarded;
    }
    return json::parse(text.begin(), text.end(), nullptr, false, true);
}

std::string reasonOf(const json::exception& error) {
    const std::string what =
        error.what();  // "[json.exception.type_error.302] type must be string, but is null"
    const size_t start = what.find("] ");
    return shortened(what.starts_with("[json.") && start != std::string::npos ? what.substr(start + 2)
                                                                              : what);
}

std::string shownJson(const json& value) {
    return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace brume
