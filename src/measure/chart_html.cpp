#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "error.hpp"
#include "frame/pending_file.hpp"
#include "measure/chart_csv.hpp"
#include "measure/chart_page.hpp"

namespace brume {
namespace {

namespace fs = std::filesystem;

const char* style = R"(<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<style>
:root { color-scheme: light; }
body { font: 15px/1.5 "DejaVu Sans", "Segoe UI", system-ui, sans-serif; color: #222; background: #fff; margin: 0 auto; max-width: 1020px; padding: 24px; }
h1 { font-size: 26px; margin: 0 0 8px; } h2 { font-size: 21px; margin: 48px 0 8px; border-top: 1px solid #ddd; padding-top: 20px; } h3 { font-size: 16px; margin: 24px 0 6px; }
p { max-width: 46em; } nav a { margin-right: 1em; } a { color: #0072b2; }
img { max-width: 100%; height: auto; } .maps { display: flex; flex-wrap: wrap; gap: 10px; } .maps img { width: 330px; } figure { margin: 0 0 8px; } figcaption { font-size: 13px; color: #444; }
table { border-collapse: collapse; font-size: 13.5px; margin: 8px 0; } th, td { padding: 3px 12px 3px 0; text-align: left; border-bottom: 1px solid #eee; } th { font-weight: 600; border-color: #999; }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; } tr.frontier td { background: #f6f1e2; } .problem { color: #a33; } .grey { color: #666; }
summary { cursor: pointer; color: #0072b2; margin: 8px 0; }
</style>)";

std::string escaped(const std::string& s) {
    std::string out;
    for (char c : s) switch (c) {
            case '&':
                out += "&amp;";
                break;
            case '<':
                out += "&lt;";
                break;
            case '>':
                out += "&gt;";
                break;
            case '"':
                out += "&quot;";
                break;
            default:
                out += c;
        }
    return out;
}

std::string base64(const std::string& bytes) {
    static const char* letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out;
    for (size_t k = 0; k < bytes.size(); k += 3) {
        uint32_t group = 0;
        for (size_t n = 0; n < 3; n++)
            group = group << 8 | (k + n < bytes.size() ? uint8_t(bytes[k + n]) : 0u);
        for (size_t n = 0; n < 4; n++)
            out += k + n > bytes.size() ? '=' : letters[group >> (18 - 6 * n) & 63];
    }
    return out;
}

std::string bytesOf(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    std::ostringstream bytes;
    bytes << in.rdbuf();
    return in ? bytes.str() : "";
}

std::string cell(const std::string& s, bool isNumber = true) {
    return text("<td", isNumber ? " class=\"n\"" : "", ">", escaped(s), "</td>");
}

std::string spreadOf(const ChartRow& r) { return shortNumber(r.low) + " to " + shortNumber(r.high); }
std::string copiesOf(const ChartRow& r) { return r.copy > 0 ? shortNumber(r.milliseconds / r.copy) : "–"; }

void writeTable(std::ostream& out, const std::vector<const ChartRow*>& rows, bool hasCases) {
    out << "<table><tr>" << (hasCases ? "<th>case</th>" : "")
        << "<th>method</th><th>on</th><th class=\"n\">ms</th><th class=\"n\">quartiles</th><th "
           "class=\"n\">runs</th><th class=\"n\">frame copies</th>"
           "<th class=\"n\">worst</th><th class=\"n\">99.9 %</th><th class=\"n\">RMS</th></tr>\n";
    for (const ChartRow* r : rows) {
        out << "<tr" << (r->onFrontier ? " class=\"frontier\"" : "") << ">"
            << (hasCases ? cell(r->caseName, false) : "") << cell(r->label(), false)
            << cell(r->backend, false);
        if (!r->problem.empty())
            out << "<td colspan=\"7\" class=\"problem\">" << escaped(r->problem) << "</td>";
        else
            out << cell(shortNumber(r->milliseconds)) << cell(spreadOf(*r)) << cell(text(r->runs))
                << cell(copiesOf(*r)) << cell(r->hasError ? shortNumber(r->error.worst) : "–")
                << cell(r->hasError ? shortNumber(r->error.percentile) : "–")
                << cell(r->hasError ? shortNumber(r->error.rms) : "–");
        out << "</tr>\n";
    }
    out << "</table>\n";
}

void writeEffect(std::ostream& out, const fs::path& folder, const std::vector<ChartRow>& rows) {
    const std::string& effect = rows[0].effect;
    const auto cases = casesOf(rows);
    const bool hasCases = cases.size() > 1 || !cases[0].empty();
    out << "<h2 id=\"" << escaped(effect) << "\">" << escaped(effect) << "</h2>\n"
        << embeddedPicture(folder / (effect + ".svg"), effect + ": worst error over time");
    if (std::none_of(rows.begin(), rows.end(), [](auto& r) { return r.hasError; }))
        out << "<p>This effect has no reference: it can be timed, not judged.</p>\n";
    std::vector<const ChartRow*> frontier, all;
    for (const ChartRow& row : rows) {
        all.push_back(&row);
        if (row.onFrontier || row.isPeer()) frontier.push_back(&row);
    }
    if (!frontier.empty()) {
        out << "<h3>What no method beats"
            << (std::any_of(rows.begin(), rows.end(), [](auto& r) { return r.isPeer(); }) ? ", and peers"
                                                                                          : "")
            << "</h3>\n";
        writeTable(out, frontier, hasCases);
    }
    out << "<details><summary>All " << rows.size() << " measurements</summary>\n";
    writeTable(out, all, hasCases);
    out << "<a download=\"" << escaped(effect) << ".csv\" href=\"data:text/csv;base64," << base64(toCsv(rows))
        << "\">as CSV</a></details>\n";
    bool isFirst = true;
    for (const ChartRow& row : rows) {
        if (row.map.empty()) continue;
        if (isFirst)
            out << "<h3>Where the error is</h3>\n<p>For those methods: the error in 8-bit steps over the "
                   "picture. "
                   "Every map has the same scale, and methods below all of it have none; grey is a "
                   "discontinuity decided by the last "
                   "bits.</p>\n<div class=\"maps\">\n";
        isFirst = false;
        out << embeddedPicture(folder / row.map, row.caseName + " " + row.label());
    }
    if (!isFirst) out << "</div>\n";
}

void writeSummary(std::ostream& out, const std::vector<std::vector<ChartRow>>& effects) {
    out << "<h3>The fastest way that nobody can tell from the "
           "truth</h3>\n<table><tr><th>effect</th><th>case</th>"
           "<th>on</th><th>method</th><th class=\"n\">ms</th><th class=\"n\">frame copies</th><th "
           "class=\"n\">worst error</th></tr>\n";
    for (const auto& rows : effects) {
        std::vector<std::string> backends;
        for (const ChartRow& row : rows)
            if (!row.isPeer() && std::find(backends.begin(), backends.end(), row.backend) == backends.end())
                backends.push_back(row.backend);
        for (const std::string& name : casesOf(rows))
            for (const std::string& backend : backends) {
                const ChartRow* best = fastestUnseen(rows, name, backend);
                out << "<tr><td><a href=\"#" << escaped(rows[0].effect) << "\">" << escaped(rows[0].effect)
                    << "</a></td>" << cell(name, false) << cell(backend, false);
                if (best)
                    out << cell(best->label(), false) << cell(shortNumber(best->milliseconds))
                        << cell(copiesOf(*best)) << cell(shortNumber(best->error.worst));
                else
                    out << "<td colspan=\"4\" class=\"grey\">none of those charted</td>";
                out << "</tr>\n";
            }
    }
    out << "</table>\n";
}

bool isStability(const fs::path& file) { return file.filename().string().starts_with(stabilityStem("")); }

void writeStability(std::ostream& out, const fs::path& folder) {
    std::vector<fs::path> pictures;
    for (const auto& entry : fs::directory_iterator(folder))
        if (isStability(entry.path()) && entry.path().extension() == ".svg") pictures.push_back(entry.path());
    std::sort(pictures.begin(), pictures.end());
    if (pictures.empty()) return;
    out << "<h2 id=\"stability\">Where methods fail</h2>\n<p>Each effect's failure regimes, as its header "
           "declares them: the "
           "error of every method while what strains it grows. Tests hold the declared ranges true; "
           "<code>brume info "
           "EFFECT</code> lists them.</p>\n";
    for (const fs::path& path : pictures)
        out << embeddedPicture(path, path.stem().string()) << "<p><a download=\""
            << escaped(path.stem().string()) << ".csv\" href=\"data:text/csv;base64,"
            << base64(bytesOf(fs::path(path).replace_extension(".csv"))) << "\">as CSV</a></p>\n";
}

}  // namespace

std::string embeddedPicture(const std::string& path, const std::string& alt) {
    const std::string bytes = bytesOf(path);
    if (bytes.empty()) return "";
    const std::string type = path.ends_with(".svg") ? "image/svg+xml" : "image/png";
    return "<img alt=\"" + escaped(alt) + "\" src=\"data:" + type + ";base64," + base64(bytes) + "\">\n";
}

std::string pageHead(const std::string& title) {
    return text(style, "\n<title>", escaped(title), "</title></head><body>\n");
}

void writeChartPage(const std::string& folder) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder))
        if (entry.path().extension() == ".csv" && isChartCsv(entry.path().string()))
            files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    std::vector<std::vector<ChartRow>> effects;
    std::map<std::string, std::string> devices;
    for (const fs::path& file : files) {
        auto rows = readCsv(file.string());
        if (rows.empty()) continue;
        for (const ChartRow& row : rows) devices[row.device] = row.backend;
        effects.push_back(std::move(rows));
    }
    std::ostringstream out;
    out << pageHead("Speed against accuracy")
        << "<h1>Speed against accuracy</h1>\n<p>Every method of each effect, at every setting of its knob: "
           "how long it takes, and how "
           "far its worst pixel is from a double-precision reference, in steps of an 8-bit picture after "
           "sRGB encoding. Medians; bars span the "
           "quartiles. On GL the time is that of the passes alone, by GPU timers.</p>\n<p "
           "class=\"grey\">Measured on ";
    bool isFirst = true;
    for (const auto& [device, backend] : devices) {
        out << (isFirst ? "" : "; ") << escaped(backend) << ": " << escaped(device);
        isFirst = false;
    }
    out << ".</p>\n<nav>";
    for (const auto& rows : effects)
        out << "<a href=\"#" << escaped(rows[0].effect) << "\">" << escaped(rows[0].effect) << "</a> ";
    out << "</nav>\n";
    writeSummary(out, effects);
    for (const auto& rows : effects) writeEffect(out, folder, rows);
    writeStability(out, folder);
    out << "</body></html>\n";
    writeWhole((fs::path(folder) / "index.html").string(), out.str());
}

}  // namespace brume
