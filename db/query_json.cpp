#include "db/query_json.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <variant>

#include "legopt/input/json.h"

namespace legopt::db {
namespace {

using Json = nlohmann::json;

constexpr char kInfinity[] = "infinity";
constexpr unsigned kNibbleBits = 4, kNibbleMask = 15;

// Returns the value of a hexadecimal digit; nullopt for any other character.
std::optional<unsigned> ParseHexDigit(char c) {
  constexpr unsigned kTen = 10;
  if (c >= '0' && c <= '9') return static_cast<unsigned>(c - '0');
  if (c >= 'A' && c <= 'F') return static_cast<unsigned>(c - 'A') + kTen;
  if (c >= 'a' && c <= 'f') return static_cast<unsigned>(c - 'a') + kTen;
  return std::nullopt;
}

// Database text may contain arbitrary bytes; JSON allows only UTF-8.
std::string ValidUtf8(const std::string& text) {
  const bool ascii = std::ranges::none_of(text, [](char c) { return static_cast<signed char>(c) < 0; });
  if (ascii) return text;
  return TryParseJson(Dump(Json(text))).value_or(Json("")).get<std::string>();
}

struct ToCell {
  Json operator()(std::monostate) const { return nullptr; }
  Json operator()(std::int64_t value) const { return value; }
  Json operator()(double value) const { return value; }
  Json operator()(const std::string& value) const { return ValidUtf8(value); }
  Json operator()(const Blob& value) const { return BlobText(value.bytes); }
};

void HideInfinity(Json* cell) {
  if (!cell->is_number_float() || !std::isinf(cell->get<double>())) return;
  *cell = Json{{kInfinity, cell->get<double>() > 0 ? 1 : -1}};
}

// Restores the type of a cell. Returns false for a cell that WriteJsonRows cannot have written.
bool RestoreCell(Json* cell) {
  if (cell->is_number_unsigned()) *cell = cell->get<std::int64_t>();
  if (!cell->is_structured()) return true;
  if (!cell->is_object() || cell->size() != 1 || !cell->contains(kInfinity)) return false;
  const Json& sign = cell->at(kInfinity);
  if (sign != 1 && sign != -1) return false;
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  *cell = sign == 1 ? kInfinite : -kInfinite;
  return true;
}

bool ReadRow(Json* row, std::size_t columns, std::vector<Json>* cells) {
  if (!row->is_array() || row->size() != columns) return false;
  cells->reserve(columns);
  for (Json& cell : *row) {
    if (!RestoreCell(&cell)) return false;
    cells->push_back(std::move(cell));
  }
  return true;
}

}  // namespace

std::string BlobText(std::string_view bytes) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string text;
  text.reserve(2 * bytes.size());
  for (const char c : bytes) {
    const unsigned byte = static_cast<unsigned char>(c);
    text += kDigits[byte >> kNibbleBits];
    text += kDigits[byte & kNibbleMask];
  }
  return text;
}

std::optional<std::string> ParseBlobText(std::string_view text) {
  if (text.size() % 2 != 0) return std::nullopt;
  std::string bytes;
  bytes.reserve(text.size() / 2);
  for (std::size_t i = 0; i < text.size(); i += 2) {
    const auto high = ParseHexDigit(text[i]), low = ParseHexDigit(text[i + 1]);
    if (!high || !low) return std::nullopt;
    bytes.push_back(static_cast<char>((*high << kNibbleBits) | *low));
  }
  return bytes;
}

JsonRows ToJsonRows(const QueryResult& result) {
  JsonRows json;
  json.truncated = result.truncated;
  for (const std::string& column : result.columns) json.columns.push_back(ValidUtf8(column));
  json.rows.reserve(result.rows.size());
  for (const auto& row : result.rows) {
    auto& cells = json.rows.emplace_back();
    cells.reserve(row.size());
    for (const Value& value : row) cells.push_back(std::visit(ToCell{}, value));
  }
  return json;
}

std::string WriteJsonRows(JsonRows result, std::size_t max_bytes) {
  constexpr std::size_t kEndBytes = sizeof(R"(,],"truncated":false})");
  std::string text = R"({"columns":)" + Dump(Json(std::move(result.columns))) + R"(,"rows":[)";
  std::string_view separator;
  for (auto& row : result.rows) {
    for (Json& cell : row) HideInfinity(&cell);
    const std::string cells = Dump(Json(std::move(row)));
    if (text.size() + cells.size() + kEndBytes > max_bytes) {
      result.truncated = true;
      break;
    }
    text.append(separator).append(cells);
    separator = ",";
  }
  return text + R"(],"truncated":)" + (result.truncated ? "true}" : "false}");
}

std::optional<JsonRows> ReadJsonRows(std::string_view text) {
  Json json = TryParseJson(text).value_or(nullptr);
  if (!json.is_object() || !json.contains("columns") || !json.contains("rows")) return std::nullopt;
  const Json columns = json.at("columns"), truncated = json.value("truncated", Json(false));
  const bool named = columns.is_array() && std::ranges::all_of(columns, [](const Json& c) { return c.is_string(); });
  if (!named || !json.at("rows").is_array() || !truncated.is_boolean()) return std::nullopt;
  JsonRows result;
  result.columns = columns.get<std::vector<std::string>>();
  result.truncated = truncated.get<bool>();
  result.rows.reserve(json.at("rows").size());
  for (Json& row : json.at("rows")) {
    if (!ReadRow(&row, result.columns.size(), &result.rows.emplace_back())) return std::nullopt;
  }
  return result;
}

}  // namespace legopt::db
