// The papers' experiments as they are written down, and what came of them as a table and a page.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "effect/preset.hpp"
#include "error.hpp"
#include "install_root.hpp"
#include "measure/chart_csv.hpp"
#include "measure/chart_page.hpp"
#include "measure/papers.hpp"
#include "nearest_name.hpp"
#include "strict_json.hpp"

namespace brume {
namespace {

using json = nlohmann::json;

void checkKeys(const json& object, const std::string& where, const std::vector<std::string>& known) {
    if (!object.is_object()) failUsage(where, ": must be an object");
    for (const auto& [key, value] : object.items())
        if (std::find(known.begin(), known.end(), key) == known.end())
            failUsage(where, ": unknown key '", key, "'", suggestion(key, known));
}

std::string word(const json& object, const char* key, const std::string& where) {
    auto found = object.find(key);
    if (found == object.end()) return {};
    if (!found->is_string()) failUsage(where, ": ", key, " must be text");
    return *found;
}

PaperExperiment::Row readRow(const json& object, const std::string& where, const EffectRegistry& registry) {
    checkKeys(object, where, {"name", "paper", "size", "preset", "effects"});
    PaperExperiment::Row row;
    row.name = word(object, "name", where);
    row.paper = word(object, "paper", where);
    if (object.contains("size") &&
        std::sscanf(word(object, "size", where).c_str(), "%dx%d", &row.size.width, &row.size.height) != 2)
        failUsage(where, ": size should be WIDTHxHEIGHT, such as 1024x1024");
    if (object.contains("preset") == object.contains("effects"))
        failUsage(where, ": needs a preset or effects, one of them");
    row.chain = object.contains("preset")
                    ? readPreset(word(object, "preset", where), registry)
                    : parsePreset(json{{"effects", object["effects"]}}.dump(), where, registry);
    return row;
}

std::string field(const std::string& s) {
    std::string out = "\"";
    for (char c : s) {
        if (c == '"') out += '"';
        out += c;
    }
    return out + '"';
}

std::string escaped(const std::string& s) {
    std::string out;
    for (char c : s)
        if (c == '<')
            out += "&lt;";
        else if (c == '&')
            out += "&amp;";
        else
            out += c;
    return out;
}

// A row's mean over the frames, on one backend.
struct Mean {
    const PaperResult* first = nullptr;
    double milliseconds = 0, worst = 0, rms = 0, coarse = 0, change = 0, shared = 0;
    int count = 0;
};

Mean meanOf(const std::vector<const PaperResult*>& results, const std::string& row,
            const std::string& backend) {
    Mean mean;
    for (const PaperResult* r : results) {
        if (r->row != row || r->backend != backend || !r->problem.empty()) continue;
        mean.first = r;
        mean.milliseconds += r->milliseconds;
        mean.worst = std::max(mean.worst, r->worst);
        mean.rms += r->rms;
        mean.coarse += r->coarse;
        mean.change += r->change;
        mean.shared += r->shared;
        mean.count++;
    }
    if (mean.count)
        for (double* sum : {&mean.milliseconds, &mean.rms, &mean.coarse, &mean.change, &mean.shared})
            *sum /= mean.count;
    return mean;
}

}  // namespace

std::string shippedPapers() { return installRoot() + "/papers.json"; }

std::vector<PaperExperiment> readPapers(const std::string& path, const EffectRegistry& registry) {
    std::ifstream in(path, std::ios::binary);
    if (!in) failUsage(path, ": no such file of experiments");
    json all;
    try {
        all = json::parse(in, nullptr, true, true);
    } catch (const json::parse_error& e) {
        failUsage(path, ": not JSON: ", reasonOf(e));
    }
    checkKeys(all, path, {"experiments"});
    std::vector<PaperExperiment> experiments;
    for (const json& object : all.value("experiments", json::array())) {
        PaperExperiment experiment;
        const std::string where = text(path, ": experiments[", experiments.size(), "]");
        checkKeys(object, where, {"paper", "title", "measured", "against", "seconds", "shown", "rows"});
        experiment.paper = word(object, "paper", where);
        experiment.title = word(object, "title", where);
        experiment.measured = word(object, "measured", where);
        experiment.against = word(object, "against", where);
        if (object.contains("seconds")) {
            if (!object["seconds"].is_number() || !(object["seconds"] > 0) || !(object["seconds"] <= 60))
                failUsage(where, ": seconds must be a number above 0, at most 60");
            if (experiment.against.empty())
                failUsage(where, ": seconds needs against: motion of what is compared");
            experiment.seconds = object["seconds"];
        }
        if (object.contains("shown")) {
            if (!object["shown"].is_boolean()) failUsage(where, ": shown must be true or false");
            experiment.isShown = object["shown"];
        }
        std::vector<std::string> names;
        for (const json& row : object.value("rows", json::array())) {
            experiment.rows.push_back(readRow(row, text(where, ": rows[", names.size(), "]"), registry));
            names.push_back(experiment.rows.back().name);
        }
        if (!experiment.against.empty() &&
            std::find(names.begin(), names.end(), experiment.against) == names.end())
            failUsage(where, ": against: no row '", experiment.against, "'",
                      suggestion(experiment.against, names));
        experiments.push_back(std::move(experiment));
    }
    return experiments;
}

std::string toCsv(const std::vector<PaperResult>& results) {
    std::ostringstream out;
    out.precision(9);
    out << "paper,title,measured,row,printed,against,backend,device,frame,width,height,milliseconds,quartile_"
           "low,"
           "quartile_high,compared,worst,rms,coarse_rms,moves,change,shared,picture,problem\n";
    for (const PaperResult& r : results) {
        for (const std::string* s : {&r.paper, &r.title, &r.measured, &r.row, &r.printed, &r.against,
                                     &r.backend, &r.device, &r.frame})
            out << field(*s) << ',';
        out << r.size.width << ',' << r.size.height << ',' << r.milliseconds << ',' << r.low << ',' << r.high
            << ',' << (r.hasDifference ? 1 : 0) << ',' << r.worst << ',' << r.rms << ',' << r.coarse << ','
            << (r.hasMotion ? 1 : 0) << ',' << r.change << ',' << r.shared << ',' << field(r.picture) << ','
            << field(r.problem) << '\n';
    }
    return out.str();
}

std::string papersPage(const std::vector<PaperResult>& results, const std::string& folder) {
    std::ostringstream out;
    std::set<std::string> frames, backends;
    std::map<std::string, std::string> devices;
    std::vector<std::string> titles;
    for (const PaperResult& r : results) {
        frames.insert(r.frame);
        backends.insert(r.backend);
        devices[r.backend] = r.device;
        if (std::find(titles.begin(), titles.end(), r.title) == titles.end()) titles.push_back(r.title);
    }
    out << pageHead("The papers' experiments, run again")
        << "<h1>The papers' experiments, run again</h1>\n<p>What each paper printed, on its machine, beside "
           "what brume "
           "measures here: medians, means over the frames";
    for (const std::string& frame : frames) out << (frame == *frames.begin() ? " " : ", ") << escaped(frame);
    out << ". Differences are in 8-bit steps after encoding: the worst pixel of all frames, the root mean "
           "square, and that of "
           "means over 16×16 pixels, which bands keep and fine noise loses.</p>\n<p class=\"grey\">Measured "
           "on ";
    for (const auto& [backend, device] : devices)
        out << (backend == devices.begin()->first ? "" : "; ") << backend << ": " << escaped(device);
    out << ".</p>\n";
    for (const std::string& title : titles) {
        std::vector<const PaperResult*> mine;
        for (const PaperResult& r : results)
            if (r.title == title) mine.push_back(&r);
        out << "<h2>" << escaped(title) << "</h2>\n<p>" << escaped(mine[0]->paper) << ": "
            << escaped(mine[0]->measured) << ".</p>\n<table><tr><th></th><th>printed</th>";
        for (const std::string& backend : backends)
            out << "<th class=\"n\">ms, " << backend << "</th><th class=\"n\">× first</th>";
        const bool isCompared = !mine[0]->against.empty();
        if (isCompared)
            out << "<th class=\"n\">worst</th><th class=\"n\">RMS</th><th class=\"n\">RMS of means</th>";
        const bool moves = std::any_of(mine.begin(), mine.end(), [](auto* r) { return r->hasMotion; });
        if (moves) out << "<th class=\"n\">change a frame</th><th class=\"n\">moves with</th>";
        out << "</tr>\n";
        std::vector<std::string> rows;
        for (const PaperResult* r : mine)
            if (std::find(rows.begin(), rows.end(), r->row) == rows.end()) rows.push_back(r->row);
        for (const std::string& row : rows) {
            const auto one = std::find_if(mine.begin(), mine.end(), [&](auto* r) { return r->row == row; });
            out << "<tr><td>" << escaped(row) << "</td><td>" << escaped((*one)->printed) << "</td>";
            Mean shown;
            for (const std::string& backend : backends) {
                const Mean mean = meanOf(mine, row, backend), base = meanOf(mine, rows[0], backend);
                if (mean.count && !shown.count) shown = mean;
                if (mean.count)
                    out << "<td class=\"n\">" << shortNumber(mean.milliseconds) << "</td><td class=\"n\">"
                        << (base.count ? shortNumber(mean.milliseconds / base.milliseconds) : "–") << "</td>";
                else
                    out << "<td colspan=\"2\" class=\"problem\">failed</td>";
            }
            if (isCompared && shown.count && row != (*one)->against)
                out << "<td class=\"n\">" << shortNumber(shown.worst) << "</td><td class=\"n\">"
                    << shortNumber(shown.rms) << "</td><td class=\"n\">" << shortNumber(shown.coarse)
                    << "</td>";
            else if (isCompared)
                out << "<td colspan=\"3\" class=\"grey\">compared with this</td>";
            if (moves && shown.count)
                out << "<td class=\"n\">" << shortNumber(shown.change) << "</td><td class=\"n\">"
                    << shortNumber(shown.shared) << "</td>";
            out << "</tr>\n";
        }
        out << "</table>\n";
        if (moves)
            out << "<p><i>Change a frame</i> is what changes from one frame to the next at 24 a second, root "
                   "mean "
                   "square; <i>moves with</i> how much of it goes with the changes of “"
                << escaped(mine[0]->against)
                << "” (the correlation). Below: opacity at the start, the middle and the end, then one line "
                   "of the "
                   "picture from the start (top) to the end, where what moves evenly draws slanted "
                   "streaks.</p>\n";
        if (std::any_of(mine.begin(), mine.end(), [](auto* r) { return !r->picture.empty(); })) {
            out << "<div class=\"" << (moves ? "strips" : "maps") << "\">\n";
            for (const PaperResult* r : mine)
                if (!r->picture.empty())
                    out << "<figure>" << embeddedPicture(folder + "/" + r->picture, r->row) << "<figcaption>"
                        << escaped(r->row) << ", " << r->backend << "</figcaption></figure>\n";
            out << "</div>\n";
        }
    }
    out << "</body></html>\n";
    return out.str();
}

}  // namespace brume
