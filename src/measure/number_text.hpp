// Numbers as people write them in charts and tables.
#pragma once

#include <string>

namespace brume {

/// "1e+06" as "1e6", "1e-05" as "1e-5"; other words as they are.
inline std::string shortExponent(std::string number) {
    const size_t e = number.find('e');
    if (e == std::string::npos || e + 1 == number.size()) return number;
    if (number[e + 1] == '+') number.erase(e + 1, 1);
    const size_t digits = number[e + 1] == '-' ? e + 2 : e + 1;
    while (digits + 1 < number.size() && number[digits] == '0') number.erase(digits, 1);
    return number;
}

}  // namespace brume
