// brume info: one effect's parameters.
#include <algorithm>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "commands.hpp"
#include "effect/effect.hpp"
#include "effect/preset.hpp"
#include "measure/stability.hpp"
#include "shell_word.hpp"

namespace brume::host {
namespace {

std::string joined(const std::vector<std::string>& words, const char* between) {
    std::string all;
    for (const std::string& word : words) all += (all.empty() ? "" : between) + word;
    return all;
}

std::string numbers(const std::vector<double>& values) {
    std::ostringstream out;
    for (size_t k = 0; k < values.size(); k++) out << (k ? "," : "") << values[k];
    return values.size() == 1 ? out.str() : "(" + out.str() + ")";
}

// One number where all components agree.
std::string range(const std::vector<double>& low, const std::vector<double>& high) {
    auto one = [](const std::vector<double>& bound, const char* otherwise) -> std::string {
        if (bound.empty()) return otherwise;
        bool isUniform = std::adjacent_find(bound.begin(), bound.end(), std::not_equal_to<>()) == bound.end();
        return numbers(isUniform ? std::vector<double>{bound[0]} : bound);
    };
    if (low.empty() && high.empty()) return "";
    return one(low, "-∞") + " to " + one(high, "∞");
}

std::string typeName(const Parameter& p) {
    switch (p.type) {
        case ParameterType::Event:
            return "event";
        case ParameterType::Bool:
            return "yes or no";
        case ParameterType::Long:
            return p.values.empty() ? "whole number" : "choice";
        case ParameterType::Float:
            return "number";
        case ParameterType::Point2D:
            return "2 numbers";
        case ParameterType::Point3D:
            return "3 numbers";
        case ParameterType::Color:
            return "colour";
        case ParameterType::Image:
            return "image";
        case ParameterType::List:
            return "list";
        default:
            return "audio";
    }
}

// UTF-8 characters, for columns.
size_t widthOf(const std::string& text) {
    return size_t(std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

std::string padded(const std::string& text, size_t width) {
    size_t own = widthOf(text);
    return text + std::string(own < width ? width - own : 0, ' ');
}

// Wraps to the terminal's usual width, later lines indented.
void printWrapped(const std::string& text, const std::string& indent) {
    std::istringstream words(text);
    std::string line = indent;
    for (std::string word; words >> word;) {
        if (line.size() > indent.size() && widthOf(line) + widthOf(word) >= 100) {
            std::cout << line << "\n";
            line = indent;
        }
        line += (line.size() > indent.size() ? " " : "") + word;
    }
    if (line.size() > indent.size()) std::cout << line << "\n";
}

void printParameters(const EffectHeader& header, std::vector<Parameter> parameters,
                     const std::string& indent) {
    // Those of no group first: a group's heading has no end.
    std::stable_partition(parameters.begin(), parameters.end(),
                          [](const Parameter& p) { return p.group.empty(); });
    size_t widest = 0;
    for (const Parameter& p : parameters) widest = std::max(widest, widthOf(p.name));
    std::string group;
    for (const Parameter& p : parameters) {
        if (p.group != group) std::cout << indent << "[" << (group = p.group) << "]\n";
        std::cout << indent << padded(p.name, widest + 2) << typeName(p);
        if (!p.unit.empty()) std::cout << " in " << p.unit;
        if (p.type == ParameterType::List)
            std::cout << " of at most " << p.maxRows << " rows";
        else if (p.values.empty())
            if (std::string limits = range(p.min, p.max); !limits.empty() && p.type != ParameterType::Bool)
                std::cout << ", " << limits;
        std::string usual = range(p.uiMin.empty() ? p.min : p.uiMin, p.uiMax.empty() ? p.max : p.uiMax);
        if (!usual.empty() && usual != range(p.min, p.max)) std::cout << " (usually " << usual << ")";
        if (p.type != ParameterType::Image && p.type != ParameterType::List)
            std::cout << "; default " << nlohmann::json(toJson(p, p.defaultValue)).dump();
        std::cout << "\n";
        std::string deeper = indent + std::string(widest + 2, ' ');
        if (!p.labels.empty())
            printWrapped("one of: " + joined(p.labels, ", ") + (p.allowsAuto ? ", auto" : ""), deeper);
        if (!p.hint.empty()) printWrapped(p.hint, deeper);
        if (!p.when.empty()) printWrapped("only when " + conditionWords(header, p, &Parameter::name), deeper);
        if (!p.sidecar.empty())
            printWrapped("from the frame's sidecar (" + p.sidecar + ") unless given", deeper);
        if (p.type == ParameterType::List) printParameters(header, p.fields, deeper);
    }
}

std::string passLine(const Pass& pass) {
    std::string line = pass.target.empty() ? "output" : pass.target;
    if (!pass.width.empty() || !pass.height.empty())
        line += ", " + (pass.width.empty() ? "full" : pass.width.source()) + " × " +
                (pass.height.empty() ? "full" : pass.height.source());
    if (pass.isFloat) line += ", float";
    if (pass.persistent) line += ", kept from frame to frame";
    if (pass.compute) line += ", compute";
    if (!pass.when.empty()) line += ", when " + pass.when.source();
    if (!pass.repeat.empty()) line += ", repeated " + pass.repeat.source();
    return line;
}

// The header's sentences, and the map that tests/stability holds true: which method holds over which stress,
// and beneath, where none holds, why.
void printBreaks(const Effect& effect) {
    auto regimes = regimesOf(effect.header, effect.plugin && effect.plugin->hasPlan());
    if (effect.header.breaks.empty() && regimes.empty()) return;
    if (!effect.header.breaks.empty()) std::cout << "\nWhere it breaks\n";
    for (const std::string& sentence : effect.header.breaks) printWrapped("- " + sentence, "  ");
    if (regimes.empty()) return;
    std::cout << "\nWhere each method holds: off by at most half an 8-bit step, as measured\n";
    for (const Regime& regime : regimes) {
        std::cout << "  " << (regime.name == regime.stress ? "" : regime.name + "; ") << rangeText(regime)
                  << "\n";
        // Lines that hold over the same stress share one line of text.
        std::vector<std::pair<std::string, std::vector<std::string>>> alike;
        for (const RegimeLine& line : regime.lines) {
            const std::string holds = holdsText(regime, line);
            auto same = std::find_if(alike.begin(), alike.end(), [&](auto& a) { return a.first == holds; });
            if (same == alike.end()) same = alike.insert(alike.end(), {holds, {}});
            same->second.push_back(line.name);
        }
        for (const auto& [holds, names] : alike) {
            const bool isAll = alike.size() == 1;
            if (isAll && holds == "everywhere")
                std::cout << "    everything holds\n";
            else
                printWrapped((isAll && names.size() > 1 ? "all" : joined(names, ", ")) + ": " + holds,
                             "    ");
        }
        if (!regime.breaks.empty()) printWrapped("elsewhere: " + regime.breaks, "    ");
    }
}

// True where `name` is a preset: what it holds, and where, to copy and change.
bool printPreset(const std::string& name) {
    auto presets = shippedPresets();
    if (name.ends_with(".json")) presets.emplace_back(name, name);
    for (const auto& [preset, path] : presets) {
        if (preset != name) continue;
        const Chain chain = readPreset(path, EffectRegistry::standard());
        std::cout << name << " (preset)\n";
        printWrapped(chain.description, "  ");
        std::cout << "\n" << writePreset(chain) << "\nFile: " << path << "\n";
        return true;
    }
    return false;
}

// What to type first: the effect alone with a parameter of its own changed, and the presets that hold it. One
// that works on what others make does nothing alone: then such a preset.
void printExamples(const EffectHeader& header, const std::string& asNamed) {
    const Parameter* first = nullptr;
    bool needsOthers = false;
    for (const Parameter& p : header.parameters) {
        if (!first && p.type == ParameterType::Float && p.defaultValue.numbers.size() == 1 &&
            p.defaultValue.numbers[0] > 0)
            first = &p;
        needsOthers |= p.type == ParameterType::Image && !p.defaultValue.text.empty();
    }
    std::vector<std::string> presets;
    for (const auto& [preset, path] : shippedPresets()) {
        const Chain chain = readPreset(path, EffectRegistry::standard());
        if (std::any_of(chain.steps.begin(), chain.steps.end(),
                        [&](const Step& s) { return s.effect->name() == header.name; }))
            presets.push_back(preset);
    }
    needsOthers &= !presets.empty();
    const std::string chain = needsOthers ? presets.front() : shellWord(asNamed);
    std::cout << "\nTry\n  brume apply " << chain << " FRAME -o OUT.png";
    if (first)
        std::cout << " --set " << header.name << "." << first->name << "="
                  << first->defaultValue.numbers[0] / 2;
    std::cout << "\n  brume preview FRAME " << chain << "\n";
    if (needsOthers) std::cout << "  (alone it has nothing to work on but the frame)\n";
    if (!presets.empty()) printWrapped("presets with it (brume info PRESET): " + joined(presets, ", "), "  ");
}

void info(const std::string& name) {
    if (printPreset(name)) return;
    auto effect = EffectRegistry::standard().find(name);
    const EffectHeader& header = effect->header;
    std::cout << header.name << (effect->plugin ? "" : " (GLSL only)") << "\n";
    printWrapped(header.description, "  ");
    if (!header.credit.empty()) printWrapped("Credit: " + header.credit, "  ");
    printExamples(header, name);
    std::cout << "\nParameters\n";
    printParameters(header, header.parameters, "  ");
    std::cout << "\nPasses\n";
    for (const Pass& pass : header.passes) std::cout << "  " << passLine(pass) << "\n";
    if (header.pointwise)
        std::cout << "  pointwise: neighbours in a chain share one pass over memory on the CPU\n";
    if (header.writesTransmittance) std::cout << "  writes transmittance\n";
    printBreaks(*effect);
    std::cout << "\n";
    if (const Tolerance& t = header.tolerance; effect->plugin) {
        std::cout << "Checked to: GLSL against CPU " << t.abs << " + " << t.rel
                  << "·|value|, CPU against reference " << t.reference << " of the scale";
        if (t.measured >= 0) std::cout << " (largest part ever used: " << t.measured << ")";
        std::cout << "\n";
        if (!t.reason.empty()) printWrapped(t.reason, "  ");
    }
    std::cout << "File: " << header.path << "\n";
}

}  // namespace

void addInfo(CLI::App& program) {
    auto name = std::make_shared<std::string>();
    CLI::App* command = program.add_subcommand(
        "info", "One effect: its parameters, passes, and where it breaks; or what a preset holds");
    command->add_option("EFFECT", *name, "An effect's or a preset's name, or the path of one (.fs, .json)")
        ->required();
    command->footer("Example:\n  brume info depth_fog");
    command->callback([name] { info(*name); });
}

}  // namespace brume::host
