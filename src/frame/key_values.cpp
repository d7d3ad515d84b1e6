#include "frame/key_values.hpp"

#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>

#include "error.hpp"

namespace brume {

using nlohmann::json;

json keyValues(const std::string& text, const std::string& where) {
    json object = json::object();
    std::istringstream rest(text);
    for (std::string item; std::getline(rest, item, ',');) {
        const size_t equals = item.find('=');
        if (equals == std::string::npos) failUsage(where, ": ", item, " is not key=value");
        const std::string key = item.substr(0, equals), value = item.substr(equals + 1);
        char* end = nullptr;
        const double asNumber = std::strtod(value.c_str(), &end);
        const bool isNumber = !value.empty() && *end == 0;
        json parsed = value == "true" || value == "false"   ? json(value == "true")
                      : isNumber && std::isfinite(asNumber) ? json(asNumber)
                                                            : json(value);
        // "unknown=0,unknown=65535" adds up; so does "range=-1,range=1".
        if (object.contains(key)) {
            if (!object[key].is_array()) object[key] = json::array({object[key]});
            object[key].push_back(parsed);
        } else {
            object[key] = parsed;
        }
    }
    return object;
}

}  // namespace brume
