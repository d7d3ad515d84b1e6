// Charts' measurements as a table: what every chart, page and document is made from.
#pragma once

#include <string>
#include <vector>

#include "measure/chart.hpp"

namespace brume {

/// RFC 4180: a line of names, then a line for each row. Numbers in the C locale, enough digits to read the
/// same again.
std::string toCsv(const std::vector<ChartRow>& rows);

/// What toCsv wrote. Throws Error (Io) naming `where`, the line and what is wrong with it.
std::vector<ChartRow> fromCsv(const std::string& csv, const std::string& where);

/// The same with files. Throws Error (Io).
void writeCsv(const std::vector<ChartRow>& rows, const std::string& path);
std::vector<ChartRow> readCsv(const std::string& path);
/// True where that file begins as one of ours: its folder may hold other tables.
bool isChartCsv(const std::string& path);

}  // namespace brume
