#include "client/report/listing_writer.h"

#include <algorithm>
#include <iostream>
#include <utility>

#include "app/program_main.h"
#include "app/value_list.h"
#include "client/client_error.h"
#include "client/report/json_text.h"
#include "client/report/listing.h"

namespace legopt::client {

void ListingWriter::Begin(const std::vector<std::string>& columns) {
  names_ = DistinctNames(columns);
  if (!kept_.empty()) {
    const auto is_column = [all = names_](const std::string& text) {
      return std::ranges::find(all, text) != all.end();
    };
    names_.clear();
    for (const std::string& list : kept_) {
      for (std::string& name : app::SplitValues(list, is_column)) names_.push_back(std::move(name));
    }
  }
  positions_ = ColumnPositions(columns, names_);
  begun_ = true;
  if (format_ == Format::kCsv) std::cout << CsvHeader(names_);
}

void ListingWriter::Row(const std::vector<nlohmann::json>& row) {
  if (!std::cout) throw ClientError(ExitCode::kUsage, app::OutputFault());
  std::vector<nlohmann::json> cells;
  for (const std::size_t position : positions_) cells.push_back(row[position]);
  if (format_ == Format::kCsv) {
    std::cout << CsvRow(cells);
    return;
  }
  std::cout << (any_row_ ? ",\n" : "[\n") << IndentedJsonRow(names_, cells);
  any_row_ = true;
}

void ListingWriter::End() {
  if (!begun_ || format_ == Format::kCsv) return;
  std::cout << (any_row_ ? "\n]\n" : "[]\n");
}

}  // namespace legopt::client
