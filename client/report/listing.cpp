#include "client/report/listing.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>
#include <stdexcept>

#include "app/printable.h"
#include "app/value_list.h"
#include "client/client_error.h"
#include "client/report/json_text.h"
#include "client/report/listing_text.h"
#include "client/report/markup_text.h"
#include "legopt/input/json.h"
#include "legopt/types/nearest_name.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

// Returns "inf" or "-inf"; empty for all other values. JSON cannot represent infinity, and "null" would mean SQL's
// NULL.
std::string InfinityText(const nlohmann::json& value) {
  if (!value.is_number_float() || !std::isinf(value.get<double>())) return {};
  return value.get<double>() > 0 ? "inf" : "-inf";
}

std::string CsvCell(const nlohmann::json& value) {
  if (value.is_null()) return {};
  if (const std::string infinity = InfinityText(value); !infinity.empty()) return infinity;
  return CsvField(value.is_string() ? value.get<std::string>() : Dump(value));
}

nlohmann::ordered_json JsonRow(const std::vector<std::string>& names, const std::vector<nlohmann::json>& cells) {
  auto object = nlohmann::ordered_json::object();
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::string infinity = InfinityText(cells[i]);
    object[names[i]] = infinity.empty() ? cells[i] : nlohmann::json(infinity);
  }
  return object;
}

std::string RenderMarkdown(const Listing& listing) {
  const auto numeric = NumericColumns(listing);
  std::string text = "|";
  for (const auto& column : listing.columns) text += " " + MarkdownText(app::Printable(column)) + " |";
  text += "\n|";
  for (const bool right : numeric) text += right ? " ---: |" : " --- |";
  text += "\n";
  for (const auto& row : listing.rows) {
    text += "|";
    for (const auto& value : row) text += " " + MarkdownText(ShownValue(value)) + " |";
    text += "\n";
  }
  return text;
}

std::string RenderCsv(const Listing& listing) {
  std::string text = CsvHeader(DistinctNames(listing.columns));
  for (const auto& row : listing.rows) text += CsvRow(row);
  return text;
}

}  // namespace

std::string ShownValue(const nlohmann::json& value) {
  if (value.is_null()) return "-";
  if (value.is_number_float()) {
    return FormatGeneral(value.get<double>());
  }
  // A row must be a single line, and untrusted text must not control the terminal.
  return app::Printable(value.is_string() ? value.get<std::string>() : Dump(value));
}

std::vector<bool> NumericColumns(const Listing& listing) {
  std::vector<bool> numeric(listing.columns.size(), true);
  for (const auto& row : listing.rows) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      if (!row[i].is_number() && !row[i].is_null()) numeric[i] = false;
    }
  }
  return numeric;
}

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

std::string RenderListing(const Listing& listing, ListingFormat format, const TextLayout& layout) {
  switch (format) {
    case ListingFormat::kText:
      return RenderListingText(listing, layout);
    case ListingFormat::kMarkdown:
      return RenderMarkdown(listing);
    case ListingFormat::kCsv:
      return RenderCsv(listing);
    case ListingFormat::kJson:
      return JsonText(ListingToJson(listing)) + "\n";
  }
  return {};
}

std::vector<std::string> DistinctNames(const std::vector<std::string>& columns) {
  std::set<std::string> taken(columns.begin(), columns.end()), used;
  std::vector<std::string> names;
  for (const std::string& column : columns) {
    std::string name = column;
    for (int count = 2; used.contains(name) || (name != column && taken.contains(name)); ++count) {
      name = column + "_" + std::to_string(count);
    }
    used.insert(name);
    names.push_back(std::move(name));
  }
  return names;
}

std::vector<std::size_t> ColumnPositions(const std::vector<std::string>& columns,
                                         const std::vector<std::string>& kept) {
  const std::vector<std::string> names = DistinctNames(columns);
  std::vector<std::size_t> positions;
  for (const std::string& column : kept) {
    const auto found = std::find(names.begin(), names.end(), column);
    if (found == names.end()) {
      throw ClientError(ExitCode::kUsage,
                        "--columns: there is no column '" + column + "'; " + SuggestName(column, names));
    }
    positions.push_back(static_cast<std::size_t>(found - names.begin()));
  }
  return positions;
}

std::string CsvHeader(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) text += (i == 0 ? "" : ",") + CsvField(names[i]);
  return text + "\n";
}

std::string CsvRow(const std::vector<nlohmann::json>& cells) {
  std::string text;
  for (std::size_t i = 0; i < cells.size(); ++i) text += (i == 0 ? "" : ",") + CsvCell(cells[i]);
  return text + "\n";
}

std::string IndentedJsonRow(const std::vector<std::string>& names, const std::vector<nlohmann::json>& cells) {
  std::string text = "  ";
  for (const char c : JsonText(JsonRow(names, cells))) {
    text += c;
    if (c == '\n') text += "  ";
  }
  return text;
}

Listing KeepColumns(const Listing& listing, const std::vector<std::string>& columns) {
  const auto is_column = [names = DistinctNames(listing.columns)](const std::string& text) {
    return std::ranges::find(names, text) != names.end();
  };
  Listing kept;
  kept.truncated = listing.truncated;
  for (const std::string& list : columns) {
    for (std::string& column : app::SplitValues(list, is_column)) kept.columns.push_back(std::move(column));
  }
  const std::vector<std::size_t> sources = ColumnPositions(listing.columns, kept.columns);
  for (const auto& row : listing.rows) {
    auto& line = kept.rows.emplace_back();
    for (const std::size_t source : sources) line.push_back(row[source]);
  }
  return kept;
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

std::string CsvField(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(text);
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + "\"";
}

}  // namespace legopt::client
