// brume check: GLSL against CPU against reference.
#include "measure/check.hpp"

#include <cmath>
#include <cstdio>
#include <iostream>
#include <set>

#include "check_plan.hpp"
#include "commands.hpp"
#include "cpu/cpu_runner.hpp"
#include "effect/missing_half.hpp"
#include "error.hpp"
#include "options.hpp"

namespace brume::host {
namespace {

constexpr size_t shownFailures = 10;

struct Arguments {
    std::vector<std::string> effects;
    BackendOption backend{"gl"};
    CheckOptions options;
    PlanArguments plan;
    bool verbose = false;
};

// The worst of one comparison over all cases of an effect.
struct Worst {
    Comparison comparison;
    WorstPixel pixel;
    std::string frame, parameters;
    double sum = 0;
    size_t compared = 0, leftOut = 0;

    void add(const CheckCase& c, const Comparison& one, const WorstPixel& place) {
        leftOut += one.leftOut;
        if (!one.compared) return;
        if (!compared || one.worstOfBound > comparison.worstOfBound) {
            double worst = std::max(one.worst, comparison.worst);
            comparison = one;
            comparison.worst = worst;
            pixel = place;
            frame = c.frame;
            parameters = c.parameters;
        }
        comparison.worst = std::max(comparison.worst, one.worst);
        sum += one.mean * double(one.compared);
        compared += one.compared;
    }
    std::string columns() const {
        if (!compared) return "        -         -      -";
        char line[80];
        std::snprintf(line, sizeof line, "%9.2e %9.2e %5.0f %%", comparison.worst, sum / double(compared),
                      100 * comparison.worstOfBound);
        return line;
    }
};

std::string value(const std::optional<double>& number) {
    if (!number) return "-";
    if (std::isnan(*number)) return "NaN";
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.9g", *number);
    return digits;
}

std::string placeOf(const WorstPixel& p) {
    std::string channel = p.channel < 4 ? std::string(1, "RGBA"[p.channel]) : std::to_string(p.channel);
    return text(p.image == "color" ? "" : p.image + " ", "(", p.place.x, ", ", p.place.y, ") ", channel,
                ": reference ", value(p.reference), ", CPU ", value(p.cpu), ", GLSL ", value(p.gl));
}

void printFailure(const CheckCase& c) {
    std::cout << "  FAILED on '" << c.frame << "', " << c.parameters << "\n";
    if (!c.problem.empty()) std::cout << "    " << c.problem << "\n";
    if (!c.parity.passed)
        std::cout << "    GLSL against CPU: " << c.parity.failed << " pixels; worst at "
                  << placeOf(c.parityWorst) << "\n";
    if (!c.reference.passed)
        std::cout << "    against the reference: " << c.reference.failed << " pixels; worst at "
                  << placeOf(c.referenceWorst) << "\n";
    if (!c.artefacts.empty()) std::cout << "    images: " << c.artefacts << "/\n";
}

bool checkOne(const std::string& name, Runner& cpu, Runner& gl, const Arguments& a) {
    auto effect = EffectRegistry::standard().find(name);
    std::vector<CheckCase> cases = checkEffect(effect, cpu, gl, a.options);
    Worst parity, reference;
    size_t failed = 0;
    for (const CheckCase& c : cases) {
        parity.add(c, c.parity, c.parityWorst);
        reference.add(c, c.reference, c.referenceWorst);
        failed += !c.passed();
    }
    std::string label = effect->name();
    label.resize(std::max<size_t>(label.size() + 1, 16), ' ');
    char count[16];
    std::snprintf(count, sizeof count, "%5zu", cases.size());
    std::cout << label << count << "  " << parity.columns() << "   " << reference.columns() << "  "
              << (failed ? text("FAILED ", failed) : "ok") << (effect->plugin ? "" : ", GLSL only");
    if (size_t left = parity.leftOut + reference.leftOut) std::cout << ", " << left << " pixels left out";
    std::cout << "\n";
    if (!effect->plugin) {
        const std::string unbuilt = unbuiltSource(effect->header.path);
        std::cout
            << "  " << (unbuilt.empty() ? "it has no C++ half" : unbuilt) << "\n  "
            << (unbuilt.empty() ? "" : "so ")
            << "checked is only its GLSL: NaN from finite input, the same picture twice, the same at twice "
               "the resolution\n";
    }
    if (parity.compared)
        std::cout << "  GLSL/CPU on '" << parity.frame << "', " << parity.parameters << " at "
                  << placeOf(parity.pixel) << "\n";
    if (reference.compared)
        std::cout << "  CPU/reference on '" << reference.frame << "', " << reference.parameters << " at "
                  << placeOf(reference.pixel) << "\n";
    // One frame a parameter set, and each problem once, tell enough, unless all are asked for.
    std::set<std::string> told;
    size_t shown = 0;
    for (const CheckCase& c : cases) {
        if (a.verbose)
            std::cout << "  " << c.frame << ", " << c.parameters << ": "
                      << (c.parity.compared ? c.parity.describe() : "one half only") << "\n";
        if (c.passed()) continue;
        // A shader that does not compile says the same at every one.
        bool isNew = told.insert(c.parameters).second && (c.problem.empty() || told.insert(c.problem).second);
        if (!a.verbose && (!isNew || shown >= shownFailures)) continue;
        printFailure(c);
        shown++;
    }
    if (shown < failed)
        std::cout << "  and " << failed - shown << " more failures (--verbose tells them all)\n";
    std::cout << std::flush;
    return failed == 0;
}

std::vector<std::string> namesOf(const Arguments& a) {
    const EffectRegistry& registry = EffectRegistry::standard();
    std::vector<std::string> names = a.effects;
    for (const std::string& name : names) registry.find(name);  // a wrong name before long work
    const auto refused = registry.refused();
    if (names.empty())
        for (const std::string& name : registry.names())
            if (!refused.count(name)) names.push_back(name);
    return names;
}

void check(const Arguments& a) {
    const std::vector<std::string> names = namesOf(a);
    if (a.plan.isAsked) return checkPlans(a.plan, names, a.options.seed, a.options.referencePixels);
    if (a.backend.name == "cpu" || a.backend.name == "auto")
        failUsage("--backend ", a.backend.name, ": check needs OpenGL: gl, osmesa or egl");
    const auto refused = EffectRegistry::standard().refused();
    auto cpu = makeCpuRunner(true);
    auto gl = a.backend.makeRunner({});
    std::cout << gl->describe() << "\n"
              << cpu->describe() << "\n\n"
              << "effect          cases   GLSL against CPU             CPU against reference\n"
              << "                        worst      mean  bound       worst      mean  bound\n";
    std::vector<std::string> failed;
    for (const std::string& name : names)
        if (!checkOne(name, *cpu, *gl, a)) failed.push_back(name);
    if (a.effects.empty())
        for (const auto& [name, reason] : refused) {
            std::cout << name << ": refused: " << reason << "\n";
            failed.push_back(name);
        }
    std::cout << "\nWorst and mean are of linear light, and some of these frames reach 65504; bound is the "
                 "share of "
                 "what\neach pixel was allowed.\n";
    if (failed.empty()) return;
    throw Error(ErrorKind::CheckFailed, "check failed for " + CLI::detail::join(failed, ", "));
}

}  // namespace

void addCheck(CLI::App& program) {
    auto a = std::make_shared<Arguments>();
    a->options.artefacts = "brume-check";
    CLI::App* command =
        program.add_subcommand("check", "GLSL against CPU against a double-precision reference");
    command->add_option("EFFECT", a->effects, "Effects' names or .fs files (default: all there are)");
    a->backend.addTo(*command);
    command->add_option("--seed", a->options.seed, "Of the random parameters")->capture_default_str();
    command->add_option("--random", a->options.randomSets, "How many random parameter sets")
        ->capture_default_str()
        ->check(CLI::Range(0, 1000));
    command
        ->add_option("--reference-pixels", a->options.referencePixels,
                     "At how many pixels of each frame the reference is asked")
        ->capture_default_str()
        ->check(CLI::Range(1, 1 << 20));
    command
        ->add_option("--artefacts", a->options.artefacts, "Folder for the images of failures; empty for none")
        ->capture_default_str();
    addPlanOptions(*command, a->plan);
    command->add_flag("-v,--verbose", a->verbose, "Print every case");
    command->footer(
        "Runs each effect on the same frames (random and HDR, single pixels, rows, every kind of depth, "
        "several\n"
        "cameras) at default, extreme, every choice of, and random parameters. 'bound' is how much of the "
        "allowed\n"
        "difference was used: over 100 % fails, and the exit status is 1.\n"
        "\n--plan draws parameters, lets \"auto\" choose, and measures against the reference: no 8-bit "
        "picture may be "
        "off\nby half a step.\n"
        "\nExamples:\n  brume check\n  brume check depth_fog --random 50 --seed 7\n  brume check "
        "my_filter.fs --backend egl");
    command->callback([a] { check(*a); });
}

}  // namespace brume::host
