#include "strict_json.hpp"

#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "error.hpp"

namespace brume {

using nlohmann::json;

json parseJson(std::string_view text) {
    std::vector<std::set<std::string>> keys(1);  // of each object that is open
    const auto watch = [&](int depth, json::parse_event_t event, json& parsed) {
        const size_t level = size_t(depth);
        if (event == json::parse_event_t::object_start || event == json::parse_event_t::array_start) {
            if (depth >= deepestJson) failUsage("is nested deeper than ", deepestJson, " brackets");
            if (keys.size() < level + 2) keys.resize(level + 2);
            keys[level + 1].clear();
        }
        if (event == json::parse_event_t::key && !keys[level].insert(parsed.get<std::string>()).second)
            failUsage("says \"", parsed.get<std::string>(), "\" twice");
        return true;
    };
    try {
        return json::parse(text.begin(), text.end(), watch, true, true);
    } catch (const json::out_of_range& e) {
        failUsage("holds a number that no double can hold: ", reasonOf(e));
    }
}

std::string reasonOf(const json::exception& error) {
    const std::string what =
        error.what();  // "[json.exception.type_error.302] type must be string, but is null"
    const size_t start = what.find("] ");
    return what.starts_with("[json.") && start != std::string::npos ? what.substr(start + 2) : what;
}

std::string shownJson(const json& value) {
    return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace brume
