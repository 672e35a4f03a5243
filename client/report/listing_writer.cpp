#include "client/report/listing_writer.h"

#include <iostream>

#include "app/program_main.h"
#include "client/client_error.h"
#include "client/report/table_writers.h"

namespace legopt::client {

void ListingWriter::Begin(const std::vector<std::string>& columns) {
  positions_ = ColumnPositions(columns, kept_);
  const std::vector<std::string> all = DistinctNames(columns);
  for (const std::size_t position : positions_) names_.push_back(all[position]);
  begun_ = true;
  if (format_ == TableFormat::kCsv) std::cout << CsvHeader(names_);
}

void ListingWriter::Row(const std::vector<nlohmann::json>& row) {
  if (!std::cout) throw ClientError(ExitCode::kUsage, app::OutputFault());
  std::vector<nlohmann::json> cells;
  for (const std::size_t position : positions_) cells.push_back(row[position]);
  if (format_ == TableFormat::kCsv) {
    std::cout << CsvRow(cells);
    return;
  }
  std::cout << (any_row_ ? ",\n" : "[\n") << IndentedJsonRow(names_, cells);
  any_row_ = true;
}

void ListingWriter::End() {
  if (!begun_ || format_ == TableFormat::kCsv) return;
  std::cout << (any_row_ ? "\n]\n" : "[]\n");
}

}  // namespace legopt::client
