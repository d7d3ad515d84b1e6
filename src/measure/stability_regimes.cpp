// STABILITY of an effect's header.
#include <algorithm>
#include <cmath>
#include <limits>

#include "effect/header_parts.hpp"
#include "measure/number_text.hpp"
#include "measure/stability.hpp"
#include "strict_json.hpp"

namespace brume {

using json = nlohmann::json;

namespace {

std::shared_ptr<const json> shared(json value) { return std::make_shared<const json>(std::move(value)); }

// A stress value, or one end of a range: a number, "inf" or "NaN".
double stressOf(const json& item, const Where& where) {
    if (item.is_number()) return item.get<double>();
    if (item == "inf") return HUGE_VAL;
    if (item == "-inf") return -HUGE_VAL;
    if (item == "NaN") return std::nan("");
    where.fail("a stress value must be a number, \"inf\", \"-inf\" or \"NaN\"");
}

// Round numbers, so that a header can name any of them.
std::vector<double> roundNumbers(double from, double to, int perDecade, const Where& where) {
    if (!(from > 0 && to > from && to < HUGE_VAL))
        where.fail("RANGE must ascend from a number above 0; list other values under VALUES");
    if (perDecade < 1 || perDecade > 3) where.fail("PER_DECADE must be 1, 2 (1, 3) or 3 (1, 2, 5)");
    const std::vector<std::vector<int>> digits = {{1}, {1, 3}, {1, 2, 5}};
    std::vector<double> values;
    for (int decade = int(std::floor(std::log10(from))) - 1; decade <= std::log10(to); decade++)
        for (int digit : digits[perDecade - 1]) {
            double value = std::stod(text(digit, "e", decade));
            if (value >= from * (1 - 1e-9) && value <= to * (1 + 1e-9)) values.push_back(value);
        }
    return values;
}

void readStress(const json& object, Regime& regime, const Where& where) {
    if (!object.is_object()) where.fail("must be an object with NAME, and RANGE or VALUES");
    where.checkKeys(object, {"NAME", "UNIT", "RANGE", "PER_DECADE", "VALUES", "REFUSED"});
    regime.stress = textOf(object, "NAME", where);
    regime.unit = textOf(object, "UNIT", where);
    if (regime.stress.empty()) where.fail("NAME is missing");
    if (auto range = object.find("RANGE"); range != object.end()) {
        if (!range->is_array() || range->size() != 2) where.fail("RANGE must be two numbers");
        regime.values = roundNumbers(stressOf((*range)[0], where), stressOf((*range)[1], where),
                                     object.value("PER_DECADE", 3), where);
    }
    if (auto list = object.find("VALUES"); list != object.end())
        for (const auto& item : *list) regime.values.push_back(stressOf(item, where));
    if (auto list = object.find("REFUSED"); list != object.end())
        for (const auto& item : *list) {
            regime.refused.push_back(stressOf(item, where));
            regime.values.push_back(regime.refused.back());
        }
    std::sort(regime.values.begin(), regime.values.end(),
              [](double a, double b) { return std::isnan(b) ? !std::isnan(a) : a < b; });
    if (regime.values.empty()) where.fail("there is nothing to sweep: say RANGE or VALUES");
}

std::vector<std::pair<double, double>> readHolds(const json& item, const Where& where) {
    if (!item.is_array()) where.fail("must be a range [from, to], a list of ranges, or []");
    std::vector<std::pair<double, double>> holds;
    if (item.empty()) return holds;
    const json ranges = item[0].is_array() ? item : json::array({item});
    for (const auto& range : ranges) {
        if (!range.is_array() || range.size() != 2) where.fail("a range is [from, to]");
        holds.emplace_back(stressOf(range[0], where), stressOf(range[1], where));
    }
    return holds;
}

RegimeLine readLine(const json& item, const EffectHeader& header, const Where& where) {
    RegimeLine line;
    line.set = line.frame = shared(json::object());
    if (item.is_string()) {
        line.name = item.get<std::string>();
        line.set = shared({{"method", line.name}});
    } else {
        if (!item.is_object()) where.fail("each must be a choice of the parameter 'method', or an object");
        where.checkKeys(item, {"NAME", "SET", "FRAME", "BACKENDS"});
        line.name = textOf(item, "NAME", where);
        if (line.name.empty()) where.fail("NAME is missing");
        if (auto set = item.find("SET"); set != item.end()) line.set = shared(*set);
        if (auto frame = item.find("FRAME"); frame != item.end()) line.frame = shared(*frame);
        if (auto backends = item.find("BACKENDS"); backends != item.end())
            line.onGl = std::find(backends->begin(), backends->end(), "gl") != backends->end();
    }
    for (const auto& [key, value] : line.set->items())
        if (!findParameter(header.parameters, key)) {
            std::vector<std::string> names;
            for (const auto& parameter : header.parameters) names.push_back(parameter.name);
            where.fail("SET: no parameter '", key, "'", suggestion(key, names));
        }
    return line;
}

// A choice, or a whole number, that the plan may make; not a colour.
bool isPlannable(const Parameter* p) { return p && p->allowsAuto && p->type == ParameterType::Long; }

Regime readRegime(const json& object, const EffectHeader& header, bool hasPlan, const Where& outer) {
    if (!object.is_object()) outer.fail("each must be an object");
    Regime regime;
    regime.effect = header.name;
    regime.name = textOf(object, "NAME", outer);
    if (regime.name.empty()) outer.fail("NAME is missing");
    Where where = outer.in("'" + regime.name + "'");
    where.checkKeys(object,
                    {"NAME", "STRESS", "FRAME", "SET", "METHODS", "AUTO", "HOLDS", "BREAKS", "DESCRIPTION"});
    regime.set = shared(object.value("SET", json::object()));
    regime.frame = shared(object.value("FRAME", json::object()));
    regime.breaks = textOf(object, "BREAKS", where);
    readStress(object.value("STRESS", json()), regime, where.in("STRESS"));

    const Parameter* method = findParameter(header.parameters, "method");
    if (auto methods = object.find("METHODS"); methods != object.end())
        for (const auto& item : *methods) regime.lines.push_back(readLine(item, header, where.in("METHODS")));
    else if (method)
        for (const auto& label : method->labels)
            regime.lines.push_back(readLine(label, header, where.in("METHODS")));
    else
        regime.lines.push_back(readLine({{"NAME", header.name}}, header, where));
    readLine({{"NAME", "SET"}, {"SET", *regime.set}}, header, where);  // for its check of names

    if (auto list = object.find("AUTO"); list != object.end()) {
        for (const auto& name : *list) {
            regime.autoParameters.push_back(name.get<std::string>());
            if (!isPlannable(findParameter(header.parameters, regime.autoParameters.back())))
                where.fail("AUTO: '", regime.autoParameters.back(), "' is no parameter that can be \"auto\"");
        }
    } else {
        for (const auto& parameter : header.parameters)
            if (isPlannable(&parameter) &&
                std::any_of(regime.lines.begin(), regime.lines.end(),
                            [&](const RegimeLine& line) { return line.set->contains(parameter.name); }))
                regime.autoParameters.push_back(parameter.name);
    }
    if (hasPlan && !regime.autoParameters.empty()) {
        RegimeLine line;
        line.name = "auto";
        line.isAuto = true;
        json set = json::object();
        for (const auto& name : regime.autoParameters) set[name] = "auto";
        line.set = shared(set);
        line.frame = shared(json::object());
        regime.lines.push_back(line);
    }

    const double endless = HUGE_VAL;
    for (auto& line : regime.lines) line.holds = {{-endless, endless}};
    if (auto holds = object.find("HOLDS"); holds != object.end())
        for (const auto& [name, item] : holds->items()) {
            auto line = std::find_if(regime.lines.begin(), regime.lines.end(),
                                     [&, key = name](const RegimeLine& l) { return l.name == key; });
            std::vector<std::string> known;
            for (const auto& l : regime.lines) known.push_back(l.name);
            if (line == regime.lines.end())
                where.fail("HOLDS: no method '", name, "'", suggestion(name, known));
            line->holds = readHolds(item, where.in("HOLDS").in(name));
        }
    return regime;
}

}  // namespace

std::string stressText(double stress) {
    char digits[32];
    std::snprintf(digits, sizeof digits, std::abs(stress) < 1e5 ? "%.5g" : "%.4g", stress);
    return std::isnan(stress) ? "NaN" : shortExponent(digits);
}

std::vector<Regime> regimesOf(const EffectHeader& header, bool hasPlan) {
    std::vector<Regime> regimes;
    if (!header.stability) return regimes;
    const Where where{header.path + ": STABILITY", true};
    if (!header.stability->is_array()) where.fail("must be an array of regimes");
    try {
        for (const auto& item : *header.stability)
            regimes.push_back(readRegime(item, header, hasPlan, where));
    } catch (const json::exception& error) {
        where.fail("a value has the wrong type: ", reasonOf(error));
    }
    return regimes;
}

bool RegimeLine::holdsAt(double stress) const {
    return std::any_of(holds.begin(), holds.end(), [&](const auto& range) {
        const auto [from, to] = range;
        auto slack = [](double end) { return std::isfinite(end) ? 1e-9 * std::abs(end) : 0; };
        if (std::isnan(stress)) return std::isnan(to) || (from == -HUGE_VAL && to == HUGE_VAL);
        return stress >= from - slack(from) && (std::isnan(to) || stress <= to + slack(to));
    });
}

bool holdsEverywhere(const Regime& regime, const RegimeLine& line) {
    return std::all_of(regime.values.begin(), regime.values.end(),
                       [&](double value) { return regime.isRefused(value) || line.holdsAt(value); });
}

bool Regime::isRefused(double stress) const {
    return std::any_of(refused.begin(), refused.end(), [&](double value) {
        return value == stress || (std::isnan(value) && std::isnan(stress));
    });
}

std::string rangeText(const Regime& regime) {
    std::vector<double> allowed;
    for (double value : regime.values)
        if (!regime.isRefused(value)) allowed.push_back(value);
    const bool withNaN = allowed.size() > 1 && std::isnan(allowed.back());
    if (withNaN) allowed.pop_back();
    std::string range = regime.stress;
    if (allowed.size() > 1)
        range += " from " + stressText(allowed.front()) + " to " + stressText(allowed.back());
    if (allowed.size() == 1) range += " " + stressText(allowed.front());
    std::string refused;
    for (double value : regime.refused) refused += (refused.empty() ? "" : ", ") + stressText(value);
    return range + (regime.unit.empty() ? "" : " " + regime.unit) + (withNaN ? ", and NaN" : "") +
           (refused.empty() ? "" : "; refused: " + refused);
}

std::string holdsText(const Regime& regime, const RegimeLine& line) {
    if (holdsEverywhere(regime, line)) return "everywhere";
    std::string all;
    // Runs of the values that were measured, not the header's own numbers.
    for (size_t k = 0; k < regime.values.size(); k++) {
        auto holdsAt = [&](size_t at) {
            return at < regime.values.size() && line.holdsAt(regime.values[at]) &&
                   !regime.isRefused(regime.values[at]);
        };
        if (!holdsAt(k)) continue;
        size_t last = k;
        while (holdsAt(last + 1)) last++;
        all += (all.empty() ? "" : ", ") + stressText(regime.values[k]) +
               (last > k ? " to " + stressText(regime.values[last]) : "");
        k = last;
    }
    if (all.empty()) return "nowhere";
    return all + (regime.unit.empty() ? "" : " " + regime.unit);
}

}  // namespace brume
