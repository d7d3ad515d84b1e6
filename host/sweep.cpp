#include "sweep.hpp"

#include <cmath>
#include <cstdint>
#include <cstdio>

#include "effect/preset.hpp"
#include "error.hpp"

namespace brume::host {
namespace {

std::string trimmed(const std::string& word) {
    const size_t begin = word.find_first_not_of(" \t"), end = word.find_last_not_of(" \t");
    return begin == std::string::npos ? "" : word.substr(begin, end - begin + 1);
}

std::vector<std::string> splitOutsideBrackets(const std::string& list) {
    std::vector<std::string> parts = {""};
    int depth = 0;
    for (char c : list) {
        depth += (c == '(' || c == '[') - (c == ')' || c == ']');
        if (c == ',' && depth == 0)
            parts.emplace_back();
        else
            parts.back() += c;
    }
    return parts;
}

// "name(a,b)" with that name: its arguments.
bool isCall(const std::string& value, const std::string& name, std::vector<std::string>& arguments) {
    if (!value.starts_with(name + "(") || !value.ends_with(")")) return false;
    arguments = splitOutsideBrackets(value.substr(name.size() + 1, value.size() - name.size() - 2));
    return true;
}

std::vector<double> numbersOf(const std::string& value, const std::string& where) {
    std::string inner = value;
    if (inner.starts_with("(") && inner.ends_with(")")) inner = inner.substr(1, inner.size() - 2);
    std::vector<double> numbers;
    for (const std::string& part : splitOutsideBrackets(inner)) {
        char* end = nullptr;
        numbers.push_back(std::strtod(part.c_str(), &end));
        if (part.empty() || *end != 0)
            failUsage("--set ", where, ": '", value, "' is not a number to draw from");
    }
    return numbers;
}

// FNV-1a, finished so that near texts give far numbers; the same on every machine.
double unitFrom(const std::string& text) {
    uint64_t h = 0xcbf29ce484222325u;
    for (unsigned char c : text) h = (h ^ c) * 0x100000001b3u;
    h = (h ^ h >> 30) * 0xbf58476d1ce4e5b9u;
    h = (h ^ h >> 27) * 0x94d049bb133111ebu;
    return double((h ^ h >> 31) >> 11) * 0x1p-53;
}

struct Draw {
    std::vector<std::string> arguments;
    std::vector<double> low, high;
    bool isChoice = false, isLog = false;
};

bool parseDraw(const std::string& path, const std::string& value, Draw& draw) {
    if (isCall(value, "choice", draw.arguments)) return draw.isChoice = true;
    if (!isCall(value, "random", draw.arguments)) {
        const size_t bracket = value.find('(');
        if (bracket == std::string::npos || bracket == 0 || !value.ends_with(")")) return false;
        failUsage(
            "--set ", path, ": '", value,
            "' is no way to draw a value: random(LOW,HIGH), random(LOW,HIGH,log) and choice(A,B,...) are");
    }
    draw.isLog = draw.arguments.size() == 3 && draw.arguments[2] == "log";
    if (draw.arguments.size() != 2 && !draw.isLog)
        failUsage("--set ", path, ": '", value, "' should be random(LOW,HIGH) or random(LOW,HIGH,log)");
    draw.low = numbersOf(draw.arguments[0], path);
    draw.high = numbersOf(draw.arguments[1], path);
    if (draw.low.size() != draw.high.size())
        failUsage("--set ", path, ": the ends of '", value, "' have different numbers of components");
    for (size_t k = 0; k < draw.low.size(); k++)
        if (!(draw.low[k] <= draw.high[k]) || (draw.isLog && !(draw.low[k] > 0)))
            failUsage("--set ", path, ": '", value, "' needs LOW ≤ HIGH", draw.isLog ? ", both above 0" : "");
    return true;
}

// "depth_fog.visibility" is short enough as "visibility" in a file's name.
std::string fileWord(const std::string& path, const std::string& value) {
    std::string word = path.substr(path.rfind('.') + 1) + "-" + value;
    for (char& c : word)
        if (!std::isalnum(static_cast<unsigned char>(c)) && c != '.' && c != '-') c = '_';
    return word;
}

}  // namespace

bool isDrawn(const std::string& path, const std::string& value) {
    Draw draw;
    return parseDraw(path, value, draw);
}

Sweep parseSweep(const std::string& argument) {
    size_t equals = argument.find('=');
    // An index such as boxes[2] comes before the sign, never a comma.
    if (equals == std::string::npos || equals == 0)
        failUsage("--set ", argument, ": write effect.parameter=value, or several values with commas");
    Sweep sweep{trimmed(argument.substr(0, equals)), splitOutsideBrackets(argument.substr(equals + 1))};
    for (std::string& value : sweep.values)
        if (value = trimmed(value); value.empty()) failUsage("--set ", argument, ": an empty value");
    return sweep;
}

std::vector<Variant> variantsOf(const std::vector<Sweep>& sweeps, const Chain& chain) {
    std::vector<Variant> variants = {{}};
    Chain trial = chain;
    for (const Sweep& sweep : sweeps) {
        for (const std::string& value : sweep.values) {
            Draw draw;
            if (!parseDraw(sweep.path, value, draw)) {
                setParameter(trial, sweep.path, value);
                continue;
            }
            size_t ends = draw.isChoice ? draw.arguments.size() : 2;
            for (size_t k = 0; k < ends; k++) setParameter(trial, sweep.path, draw.arguments[k]);
        }
        std::vector<Variant> product;
        for (const Variant& before : variants)
            for (const std::string& value : sweep.values) {
                Variant variant = before;
                variant.settings.emplace_back(sweep.path, value);
                if (sweep.values.size() > 1)
                    variant.label += text(variant.label.empty() ? "" : "_", fileWord(sweep.path, value));
                product.push_back(variant);
            }
        variants = std::move(product);
        if (variants.size() > 10000) failUsage("--set: more than 10000 outputs a frame");
    }
    return variants;
}

Settings drawn(const Settings& settings, const std::string& frameName, uint32_t seed) {
    Settings result = settings;
    for (auto& [path, value] : result) {
        Draw draw;
        if (!parseDraw(path, value, draw)) continue;
        std::string key = text(frameName, '\n', path, '\n', seed, '\n');
        if (draw.isChoice) {
            value = draw.arguments[size_t(unitFrom(key) * double(draw.arguments.size()))];
            continue;
        }
        std::string numbers;
        for (size_t k = 0; k < draw.low.size(); k++) {
            double u = unitFrom(text(key, k)), low = draw.low[k], high = draw.high[k];
            double number = draw.isLog ? low * std::pow(high / low, u) : low + u * (high - low);
            char digits[32];
            std::snprintf(digits, sizeof digits, "%.7g", std::min(std::max(number, low), high));
            numbers += (k ? "," : "") + std::string(digits);
        }
        value = draw.low.size() == 1 ? numbers : text("(", numbers, ")");
    }
    return result;
}

Chain withSettings(Chain chain, const Settings& settings) {
    for (const auto& [path, value] : settings) setParameter(chain, path, value);
    return chain;
}

}  // namespace brume::host
