#include "client/report/listing.h"

#include <algorithm>
#include <iostream>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "app/printable.h"
#include "client/client_error.h"
#include "client/report/table_writers.h"
#include "legopt/input/json.h"
#include "legopt/types/job.h"

namespace legopt::client {
namespace {

constexpr std::string_view kDead = ToString(JobState::kDead), kFailed = ToString(JobState::kFailed);

Emphasis EmphasisOf(const std::string& column, const nlohmann::json& value) {
  const bool count = (column == kDead || column == kFailed) && value.is_number() && value > 0;
  const bool state = column == "state" && (value == kDead || value == kFailed);
  return count || state ? Emphasis::kBad : Emphasis::kNone;
}

// Returns whether a column contains only numbers and nulls.
bool IsNumeric(const Listing& listing, std::size_t column) {
  return std::ranges::all_of(listing.rows,
                             [column](const auto& row) { return row[column].is_number() || row[column].is_null(); });
}

}  // namespace

std::size_t Listing::Column(std::string_view name) const {
  const auto found = std::find(columns.begin(), columns.end(), name);
  if (found == columns.end()) throw std::out_of_range("no column '" + std::string(name) + "' in the query's result");
  return static_cast<std::size_t>(found - columns.begin());
}

const nlohmann::json& Listing::At(std::size_t row, std::string_view column) const {
  return rows.at(row).at(Column(column));
}

std::string Listing::Text(std::size_t row, std::string_view column) const {
  const nlohmann::json& cell = At(row, column);
  if (!cell.is_string()) RefuseWord(column, Dump(cell));
  return cell.get<std::string>();
}

void Listing::RefuseWord(std::string_view column, const std::string& word) {
  throw ClientError(
      ExitCode::kDatabaseUnusable,
      "the results have " + std::string(column) + " '" + app::Printable(word) +
          "', which this legopt does not know: the database is damaged ('legopt service doctor --db FILE' checks "
          "it; restore a backup), or another release wrote it");
}

Table TableOf(const Listing& listing) {
  Table table;
  for (std::size_t i = 0; i < listing.columns.size(); ++i) {
    TableColumn column{listing.columns[i]};
    if (!IsNumeric(listing, i)) column.alignment = Alignment::kLeft;
    table.columns.push_back(std::move(column));
  }
  for (const auto& row : listing.rows) {
    auto& cells = table.rows.emplace_back().cells;
    for (std::size_t i = 0; i < row.size(); ++i) {
      cells.push_back({row[i], {}, EmphasisOf(listing.columns[i], row[i])});
    }
  }
  return table;
}

std::string RenderListing(const Listing& listing, TableFormat format, const TextLayout& layout) {
  return RenderTable(TableOf(listing), format, layout);
}

std::string RenderFields(const Listing& listing, std::size_t row, const TextLayout& layout) {
  return RenderRecord(TableOf(listing), row, layout);
}

nlohmann::ordered_json ListingToJson(const Listing& listing) {
  const std::vector<std::string> names = DistinctNames(listing.columns);
  auto array = nlohmann::ordered_json::array();
  for (const auto& row : listing.rows) array.push_back(JsonRow(names, row));
  return array;
}

Listing ListingFromJson(const nlohmann::json& array, const std::vector<std::string>& leading) {
  Listing listing;
  const auto add = [&listing](const std::string& key) {
    if (std::find(listing.columns.begin(), listing.columns.end(), key) == listing.columns.end()) {
      listing.columns.push_back(key);
    }
  };
  for (const auto& key : leading) {
    if (std::any_of(array.begin(), array.end(), [&](const auto& object) { return object.contains(key); })) add(key);
  }
  for (const auto& object : array) {
    if (!object.is_object()) continue;
    for (const auto& item : object.items()) add(item.key());
  }
  for (const auto& object : array) {
    if (!object.is_object()) continue;
    auto& row = listing.rows.emplace_back(listing.columns.size());
    for (std::size_t i = 0; i < row.size(); ++i) {
      const auto value = object.find(listing.columns[i]);
      if (value == object.end()) continue;
      row[i] = value->is_structured() ? nlohmann::json(Dump(*value)) : *value;
    }
  }
  return listing;
}

void ListingWriter::Begin(const std::vector<std::string>& columns) {
  positions_ = ColumnPositions(columns, kept_);
  const std::vector<std::string> all = DistinctNames(columns);
  for (const std::size_t position : positions_) names_.push_back(all[position]);
  begun_ = true;
  if (format_ == TableFormat::kCsv) std::cout << CsvHeader(names_);
}

void ListingWriter::Row(const std::vector<nlohmann::json>& row) {
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
