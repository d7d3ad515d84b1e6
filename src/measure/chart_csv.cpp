#include "measure/chart_csv.hpp"

#include <charconv>
#include <cstring>
#include <fstream>
#include <functional>
#include <sstream>

#include "error.hpp"
#include "frame/pending_file.hpp"

namespace brume {
namespace {

// A column: its name, how a row gives it as text, how it is read back.
struct Column {
    const char* name;
    std::function<std::string(const ChartRow&)> get;
    std::function<bool(ChartRow&, const std::string&)> set;
};

template <class Number>
std::string printed(Number value) {
    char buffer[40];
    return {buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr};
}

template <class Number>
bool parse(const std::string& digits, Number& value) {
    const char* end = digits.data() + digits.size();
    auto [stop, problem] = std::from_chars(digits.data(), end, value);
    return problem == std::errc() && stop == end;
}

template <class Place>
Column wordColumn(const char* name, Place place) {
    return {name, [place](const ChartRow& r) { return place(const_cast<ChartRow&>(r)); },
            [place](ChartRow& r, const std::string& s) { return place(r) = s, true; }};
}
template <class Place>
Column numberColumn(const char* name, Place place) {
    return {name, [place](const ChartRow& r) { return printed(place(const_cast<ChartRow&>(r))); },
            [place](ChartRow& r, const std::string& s) { return parse(s, place(r)); }};
}
template <class Place>
Column flagColumn(const char* name, Place place) {
    return {name,
            [place](const ChartRow& r) { return std::string(place(const_cast<ChartRow&>(r)) ? "1" : "0"); },
            [place](ChartRow& r, const std::string& s) {
                place(r) = s == "1";
                return s == "0" || s == "1";
            }};
}

#define PLACE(member) \
    [](ChartRow & r) -> auto& { return r.member; }
const std::vector<Column>& columns() {
    static const std::vector<Column> all = {
        wordColumn("effect", PLACE(effect)),
        wordColumn("case", PLACE(caseName)),
        wordColumn("method", PLACE(method)),
        wordColumn("knob", PLACE(knob)),
        wordColumn("value", PLACE(value)),
        wordColumn("backend", PLACE(backend)),
        wordColumn("device", PLACE(device)),
        wordColumn("frame", PLACE(frame)),
        numberColumn("width", PLACE(size.width)),
        numberColumn("height", PLACE(size.height)),
        numberColumn("milliseconds", PLACE(milliseconds)),
        numberColumn("quartile_low", PLACE(low)),
        numberColumn("quartile_high", PLACE(high)),
        numberColumn("runs", PLACE(runs)),
        numberColumn("frame_copy", PLACE(copy)),
        flagColumn("has_reference", PLACE(hasError)),
        numberColumn("worst", PLACE(error.worst)),
        numberColumn("rms", PLACE(error.rms)),
        numberColumn("percentile_99.9", PLACE(error.percentile)),
        numberColumn("worst_x", PLACE(error.place.x)),
        numberColumn("worst_y", PLACE(error.place.y)),
        numberColumn("pixels", PLACE(error.compared)),
        numberColumn("ambiguous", PLACE(error.leftOut)),
        flagColumn("frontier", PLACE(onFrontier)),
        wordColumn("problem", PLACE(problem)),
        wordColumn("map", PLACE(map)),
    };
    return all;
}
#undef PLACE

// What a spreadsheet would take for a formula; "'" before it says that it is text.
bool isFormula(const std::string& s) {
    double number = 0;
    const auto end = s.data() + s.size();
    return !s.empty() && std::strchr("=+-@\t\r", s[0]) && std::from_chars(s.data(), end, number).ptr != end;
}

std::string field(const std::string& value) {
    const std::string s = isFormula(value) ? "'" + value : value;
    if (s.find_first_of(",\"\r\n") == std::string::npos) return s;
    std::string out = "\"";
    for (char c : s) out += c == '"' ? std::string("\"\"") : std::string(1, c);
    return out + '"';
}

// Every record's fields; a quoted field may hold commas, quotes and line ends.
std::vector<std::vector<std::string>> recordsOf(const std::string& csv) {
    std::vector<std::vector<std::string>> records;
    bool isQuoted = false, isNew = true;
    for (size_t k = 0; k < csv.size(); k++) {
        const char c = csv[k];
        if (isNew) records.push_back({""});
        isNew = false;
        std::string& last = records.back().back();
        if (isQuoted) {
            if (c != '"')
                last += c;
            else if (k + 1 < csv.size() && csv[k + 1] == '"')
                last += csv[++k];
            else
                isQuoted = false;
        } else if (c == '"') {
            isQuoted = true;
        } else if (c == ',') {
            records.back().emplace_back();
        } else if (c == '\n') {
            isNew = true;
        } else if (c != '\r') {
            last += c;
        }
    }
    return records;
}

}  // namespace

std::string toCsv(const std::vector<ChartRow>& rows) {
    std::string csv;
    auto line = [&](const std::function<std::string(const Column&)>& text) {
        for (const Column& column : columns()) {
            if (&column != &columns()[0]) csv += ',';
            csv += field(text(column));
        }
        csv += '\n';
    };
    line([](const Column& column) { return std::string(column.name); });
    for (const ChartRow& row : rows) line([&](const Column& column) { return column.get(row); });
    return csv;
}

std::vector<ChartRow> fromCsv(const std::string& csv, const std::string& where) {
    const auto records = recordsOf(csv);
    std::vector<ChartRow> rows;
    for (size_t k = 0; k < records.size(); k++) {
        if (records[k].size() != columns().size())
            failIo(where, ": line ", k + 1, " has ", records[k].size(), " fields, not ", columns().size(),
                   "; remove the file and chart again");
        ChartRow row;
        for (size_t n = 0; n < columns().size(); n++) {
            const Column& column = columns()[n];
            std::string s = records[k][n];
            if (s[0] == '\'' && isFormula(s.substr(1))) s.erase(0, 1);
            if (k == 0 ? s != column.name : !column.set(row, s))
                failIo(where, ": line ", k + 1, ": '", s, "' is no ", k == 0 ? "column here, which is " : "",
                       column.name, "; remove the file and chart again");
        }
        if (k > 0) rows.push_back(row);
    }
    if (records.empty()) failIo(where, ": is empty; remove the file and chart again");
    return rows;
}

void writeCsv(const std::vector<ChartRow>& rows, const std::string& path) { writeWhole(path, toCsv(rows)); }

std::vector<ChartRow> readCsv(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    if (!in) failIo("'", path, "' cannot be read");
    std::ostringstream bytes;
    bytes << in.rdbuf();
    return fromCsv(bytes.str(), path);
}

bool isChartCsv(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    std::string line;
    std::getline(in, line);
    return line.starts_with("effect,case,method,");
}

}  // namespace brume
