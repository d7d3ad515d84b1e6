// brume convert-preset: a ReShade preset in brume's form, as far as brume has the effects.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <set>

#include "commands.hpp"
#include "effect/preset.hpp"
#include "error.hpp"
#include "frame/color_encoding.hpp"
#include "frame/pending_file.hpp"
#include "printable.hpp"
#include "reshade_preset.hpp"
#include "strict_json.hpp"

namespace brume::host {
namespace {

using Json = nlohmann::ordered_json;

// The values of one technique's section, noting which of them are used.
class Section {
  public:
    Section(const ReshadePreset& preset, const std::string& file) : preset_(preset) {
        if (auto found = preset.sections.find(file); found != preset.sections.end()) values_ = found->second;
        values_.erase("PreprocessorDefinitions");
    }

    std::vector<double> numbers(const std::string& key, const std::vector<double>& otherwise) {
        auto found = values_.find(key);
        if (found == values_.end()) return otherwise;
        const IniValue value = found->second;
        values_.erase(found);
        std::vector<double> result;
        const char *at = value.text.data(), *end = at + value.text.size();
        while (at <= end) {
            while (at < end && (*at == ' ' || *at == '+')) at++;
            double number = 0;
            auto [after, error] = std::from_chars(at, end, number);
            while (after < end && *after == ' ') after++;
            if (error != std::errc() || !std::isfinite(number) || (after < end && *after != ',')) break;
            result.push_back(number);
            if (after == end) break;
            at = after + 1;
        }
        if (result.size() != otherwise.size() ||
            size_t(std::count(value.text.begin(), value.text.end(), ',')) + 1 != result.size())
            failUsage(preset_.path, ":", value.line, ": ", key, "=", value.text, " is not ",
                      otherwise.size() == 1 ? "a number" : text(otherwise.size(), " numbers"));
        return result;
    }
    double number(const std::string& key, double otherwise) { return numbers(key, {otherwise})[0]; }
    /// Those not asked for.
    const std::map<std::string, IniValue>& rest() const { return values_; }

  private:
    const ReshadePreset& preset_;
    std::map<std::string, IniValue> values_;
};

// Six digits: a ReShade preset holds no more.
double rounded(double x) { return std::stod((std::ostringstream() << x).str()); }

Json linearColor(const std::vector<double>& encoded) {
    Json color = Json::array();
    for (double c : encoded) color.push_back(rounded(srgbDecode(c)));
    return color;
}

struct Conversion {
    const ReshadePreset& preset;
    double far;  // m: what ReShade's linear depth 1 means; 0 is 1 m
    std::vector<Json> steps;
    std::vector<std::string> lost;
    bool usesFar = false;
};

// Opacity linear in ReShade's depth: lerp(scene, FogColor, min((depth - FogStart)·FogCurve, MaxFogFactor)).
void convertSpiritFog(Section& section, Conversion& c) {
    c.usesFar = true;
    c.steps.push_back({{"effect", "depth_fog"},
                       {"model", "linear"},
                       {"near", 1},
                       {"far", c.far},
                       {"linear_start", section.number("FogStart", .05)},
                       {"curve", section.number("FogCurve", 1.5)},
                       {"max_opacity", section.number("MaxFogFactor", .8)},
                       {"color", linearColor(section.numbers("FogColor", {.9, .9, .9}))},
                       {"mixing", "encoded"}});
}

// lerp(scene, lerp(bloom, FogColor, f), f): with the scene in place of its bloom, opacity f².
void convertAdaptiveFog(Section& section, Conversion& c) {
    c.usesFar = true;
    const double start = section.number("FogStart", .05), curve = section.number("FogCurve", 1.5),
                 most = section.number("MaxFogFactor", .8);
    const Json color = linearColor(section.numbers("FogColor", {.9, .9, .9}));
    if (curve <= 0) {
        c.lost.push_back("AdaptiveFog: FogCurve is 0, so there is no fog");
        return;
    }
    c.steps.push_back({{"effect", "depth_fog"},
                       {"model", "power"},
                       {"distance_along", "planar"},
                       {"start", rounded(1 + start * (c.far - 1))},
                       {"cutoff", c.far},
                       {"power_distance", rounded((c.far - 1) / curve)},
                       {"power_exponent", 2},
                       {"max_opacity", rounded(most * most)},
                       {"color", color},
                       {"mixing", "encoded"}});
    c.lost.push_back(
        "AdaptiveFog mixes a bloom of the picture into the fog; here the picture itself stands for it");
}

void convertBesselBloom(Section& section, Conversion& c) {
    const double threshold = section.number("Threshold", .7), knee = section.number("SoftKnee", .5),
                 k = section.number("K", 128), performance = section.number("Performance", 2);
    // The filter's k is twice its time constant in px; Performance halves or doubles it.
    const double tau = k * std::exp2(std::clamp(performance, 0., 3.) - 2) / 2;
    c.steps.push_back({{"effect", "light_detect"},
                       {"luminance", "linear 709"},
                       {"threshold", threshold},
                       {"knee", rounded(threshold * knee)},
                       {"intensity", section.number("Intensity", 1)},
                       {"saturation", section.number("Saturation", 1)},
                       {"output", "lights"}});
    c.steps.push_back({{"effect", "bessel_blur"},
                       {"radius", rounded(std::sqrt(2. / 3) * tau)},
                       {"input", "lights"},
                       {"output", "glow"}});
    c.steps.push_back({{"effect", "blend"}, {"second", "glow"}, {"mode", "add"}});
    c.lost.push_back("Bessel_Bloom takes the largest channel for brightness; here it is the luminance");
}

// What brume knows. A technique is known by its name, whatever file it comes from.
struct Known {
    const char *technique, *file, *becomes;
    void (*convert)(Section&, Conversion&);
};
const Known table[] = {
    {"AdaptiveFog", "AdaptiveFog.fx", "depth_fog", convertAdaptiveFog},
    {"SpiritFog", "SpiritFog.fx", "depth_fog", convertSpiritFog},
    {"Bessel_Bloom", "Bessel_Bloom.fx", "light_detect, bessel_blur, blend", convertBesselBloom},
};

// "Spirit-Fog", "spirit_fog" and "SpiritFog" are one.
std::string plainName(const std::string& name) {
    std::string plain;
    for (unsigned char c : name)
        if (std::isalnum(c)) plain += char(std::tolower(c));
    return plain;
}

// The section of a technique: of the file it names, or else a file of its name.
std::string sectionOf(const ReshadePreset& preset, const std::string& technique, const std::string& file,
                      const std::string& usual) {
    if (!file.empty()) return file;
    for (const auto& [name, values] : preset.sections)
        if (plainName(name) == plainName(technique + ".fx")) return name;
    return usual;
}

constexpr double usualFar = 1000;  // ReShade's own, where a preset does not say

double farPlane(ReshadePreset& preset, std::optional<double> given, std::string& note) {
    auto found = preset.definitions.find("RESHADE_DEPTH_LINEARIZATION_FAR_PLANE");
    if (given) {
        if (found != preset.definitions.end()) preset.definitions.erase(found);
        note = text("distances are for a far plane at ", *given, " m, as --far says");
        return *given;
    }
    if (found == preset.definitions.end()) {
        note = text("distances are for a far plane at ", usualFar,
                    " m, ReShade's default, because the preset states none; --far METRES gives the game's");
        return usualFar;
    }
    const std::string stated = found->second;
    const double far = std::strtod(stated.c_str(), nullptr);
    preset.definitions.erase(found);
    if (!(far > 1 && far <= 1e7))
        failUsage(preset.path, ": RESHADE_DEPTH_LINEARIZATION_FAR_PLANE must be over 1");
    note = text("distances are for the preset's far plane at ", far, ", taken for metres");
    return far;
}

std::string written(const ReshadePreset& preset, const Conversion& c, const std::string& note) {
    const std::string name = std::filesystem::path(preset.path).stem().string();
    // Whatever the names and values are, each comment ends where its line does.
    const auto comment = [](const std::string& words) { return "// " + printableLine(words) + "\n"; };
    std::string out =
        comment("From the ReShade preset " + std::filesystem::path(preset.path).filename().string() + ".");
    if (!note.empty()) out += comment("Its " + note);
    for (const std::string& lost : c.lost) out += comment("Not carried: " + lost);
    out += "{\n  \"name\": " + shownJson(name) + ",\n  \"effects\": [\n";
    for (const Json& step : c.steps) {
        std::string line = step.dump(-1, ' ', false, Json::error_handler_t::replace);
        out += "    " + line + (&step == &c.steps.back() ? "\n" : ",\n");
    }
    return out + "  ]\n}\n";
}

// Together far within what readPreset takes, even with each byte shown as four.
void shorten(std::vector<std::string>& lost) {
    constexpr size_t mostLines = 1000, mostBytes = 500;
    const size_t all = lost.size();
    lost.resize(std::min(all, mostLines));
    for (std::string& line : lost) line = shortened(line, mostBytes);
    if (all > mostLines) lost.push_back(text(all - mostLines, " more"));
}

}  // namespace

ConvertedPreset convertPreset(const ReshadePreset& given, std::optional<double> far) {
    ReshadePreset preset = given;
    ConvertedPreset result;
    Conversion c{preset, farPlane(preset, far, result.note), {}, {}};
    std::set<std::string> seen;
    for (const auto& [technique, file] : preset.techniques) {
        const Known* known = nullptr;
        for (const Known& candidate : table)
            if (plainName(technique) == plainName(candidate.technique)) known = &candidate;
        const std::string name = sectionOf(preset, technique, file, known ? known->file : technique + ".fx");
        seen.insert(name);
        Section section(preset, name);
        if (known) {
            known->convert(section, c);
            result.steps.push_back(technique + ": " + known->becomes);
        } else {
            c.lost.push_back("the technique " + technique + ", which is on");
        }
        for (const auto& [key, value] : section.rest())
            c.lost.push_back("[" + name + "] " + key + "=" + value.text);
    }
    for (const auto& [name, values] : preset.sections)
        if (!seen.count(name))
            c.lost.push_back(text("[", name, "], of no technique that is on: ", values.size(),
                                  values.size() == 1 ? " key" : " keys"));
    for (const auto& [key, value] : preset.global)
        if (!value.text.empty()) c.lost.push_back(key + "=" + value.text);
    for (const auto& [key, value] : preset.definitions)
        c.lost.push_back("the definition " + key + "=" + value);
    if (c.steps.empty()) {
        std::string names;
        for (const Known& known : table) names += std::string(names.empty() ? "" : ", ") + known.technique;
        failUsage(preset.path, ": no technique that is on makes something brume has; it knows ", names);
    }
    shorten(c.lost);
    if (!c.usesFar) result.note.clear();
    result.text = written(preset, c, result.note);
    result.lost = c.lost;
    return result;
}

void addConvertPreset(CLI::App& program) {
    auto path = std::make_shared<std::string>();
    auto out = std::make_shared<std::string>();
    auto far = std::make_shared<std::optional<double>>();
    CLI::App* command =
        program.add_subcommand("convert-preset", "A ReShade preset as a preset of brume, as far as it goes");
    command->add_option("INI", *path, "The ReShade preset")->required();
    command->add_option("-o,--output", *out, "The preset to write (default: standard output)");
    command
        ->add_option(
            "--far", *far,
            "How many metres off ReShade's depth 1 lies (default: what the preset defines, or else 1000)")
        ->check(CLI::Range(1.001, 1e7));
    std::string known;
    for (const Known& entry : table) known += text("  ", entry.technique, " becomes ", entry.becomes, "\n");
    command->footer("Techniques that are on, in their order:\n" + known +
                    "What could not be carried is listed, and stands as comments in the preset.\n"
                    "\nExample:\n  brume convert-preset Foggy.ini -o foggy.json --far 400");
    command->callback([path, out, far] {
        const ConvertedPreset converted = convertPreset(readReshadePreset(*path), *far);
        parsePreset(converted.text, *path, EffectRegistry::standard());  // a value out of range says so here
        if (out->empty()) {
            std::cout << converted.text;
        } else {
            if (std::error_code none; std::filesystem::equivalent(*path, *out, none))
                failUsage("-o ", *out, ": would overwrite what it is made from");
            writeWhole(*out, converted.text);
            for (const std::string& step : converted.steps) std::cout << step << "\n";
            if (!converted.note.empty()) std::cout << converted.note << "\n";
            for (const std::string& lost : converted.lost) std::cout << "not carried: " << lost << "\n";
            std::cout << *out << "\n";
        }
    });
}

}  // namespace brume::host
