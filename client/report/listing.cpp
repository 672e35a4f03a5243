#include "client/report/listing.h"

#include <algorithm>
#include <cstdio>
#include <map>
#include <stdexcept>

#include "client/client_error.h"
#include "client/report/json_text.h"
#include "client/report/listing_text.h"
#include "legopt/input/json.h"
#include "legopt/nearest_name.h"
#include "programs/printable.h"

namespace legopt::client {
namespace {

std::string CsvCell(const nlohmann::json& value) {
  if (value.is_null()) return {};
  return CsvField(value.is_string() ? value.get<std::string>() : Dump(value));
}

std::string RenderMarkdown(const Listing& listing) {
  const auto escape = [](std::string text) {
    for (std::size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2) text.insert(at, 1, '\\');
    return text;
  };
  const auto numeric = NumericColumns(listing);
  std::string text = "|";
  for (const auto& column : listing.columns) text += " " + escape(programs::Printable(column)) + " |";
  text += "\n|";
  for (const bool right : numeric) text += right ? " ---: |" : " --- |";
  text += "\n";
  for (const auto& row : listing.rows) {
    text += "|";
    for (const auto& value : row) text += " " + escape(ShownValue(value)) + " |";
    text += "\n";
  }
  return text;
}

std::string RenderCsv(const Listing& listing) {
  std::string text;
  for (std::size_t i = 0; i < listing.columns.size(); ++i) text += (i == 0 ? "" : ",") + CsvField(listing.columns[i]);
  text += "\n";
  for (const auto& row : listing.rows) {
    for (std::size_t i = 0; i < row.size(); ++i) text += (i == 0 ? "" : ",") + CsvCell(row[i]);
    text += "\n";
  }
  return text;
}

}  // namespace

std::string ShownValue(const nlohmann::json& value) {
  if (value.is_null()) return "-";
  if (value.is_number_float()) {
    char text[32];
    std::snprintf(text, sizeof(text), "%.6g", value.get<double>());
    return text;
  }
  // One row is one line, and a terminal must not act on what others wrote.
  return programs::Printable(value.is_string() ? value.get<std::string>() : Dump(value));
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

std::string Listing::Text(std::size_t row, std::string_view column) const { return At(row, column).get<std::string>(); }

void Listing::RefuseWord(std::string_view column, const std::string& word) {
  throw ClientError(ExitCode::kInternal, "the results have " + std::string(column) + " '" + word +
                                             "', which this legopt does not know; use the release that wrote them");
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

Listing KeepColumns(const Listing& listing, const std::vector<std::string>& columns) {
  Listing kept;
  kept.columns = columns;
  kept.truncated = listing.truncated;
  std::vector<std::size_t> sources;
  for (const auto& column : columns) {
    const auto found = std::find(listing.columns.begin(), listing.columns.end(), column);
    if (found == listing.columns.end()) {
      throw ClientError(ExitCode::kUsage,
                        "--columns: there is no column '" + column + "'; " + SuggestName(column, listing.columns));
    }
    sources.push_back(static_cast<std::size_t>(found - listing.columns.begin()));
  }
  for (const auto& row : listing.rows) {
    auto& line = kept.rows.emplace_back();
    for (const std::size_t source : sources) line.push_back(row[source]);
  }
  return kept;
}

nlohmann::ordered_json ListingToJson(const Listing& listing) {
  std::vector<std::string> keys;
  std::map<std::string, int> seen;
  for (const auto& column : listing.columns) {
    const int count = ++seen[column];
    keys.push_back(count == 1 ? column : column + "_" + std::to_string(count));
  }
  auto array = nlohmann::ordered_json::array();
  for (const auto& row : listing.rows) {
    auto object = nlohmann::ordered_json::object();
    for (std::size_t i = 0; i < row.size(); ++i) object[keys[i]] = row[i];
    array.push_back(std::move(object));
  }
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
