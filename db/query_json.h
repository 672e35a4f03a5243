#pragma once

#include <cstddef>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "db/read_only_database.h"

/// JSON form of query results. The server sends it to clients. A client that reads a database file converts the rows by
/// the same functions, so a result is identical from a server and from its file.
namespace legopt::db {

/// Converts a BLOB to upper-case hexadecimal digits, two per byte, like SQL's hex().
std::string BlobText(std::string_view bytes);

/// Parses hexadecimal digits in upper or lower case. Returns nullopt for other characters or an odd number of digits.
std::optional<std::string> ParseBlobText(std::string_view text);

/// A query result with JSON scalars as cells: null, integer, real number or text. BLOBs are texts (BlobText).
struct JsonRows {
  std::vector<std::string> columns;
  std::vector<std::vector<nlohmann::json>> rows;  ///< each has columns.size() cells
  bool truncated = false;                         ///< more rows exist than the limits allowed
};

/// Converts a result; bytes that are not valid UTF-8 in texts and column names are replaced by U+FFFD.
JsonRows ToJsonRows(const QueryResult& result);

/// Returns a JSON object with "columns", "rows" and "truncated". Infinite numbers, which JSON cannot represent, become
/// the object {"infinity": 1} or {"infinity": -1}. Rows after the first `max_bytes` bytes of text are left out, and
/// "truncated" is true; the column names are always written.
std::string WriteJsonRows(JsonRows result, std::size_t max_bytes = std::numeric_limits<std::size_t>::max());

/// The inverse of WriteJsonRows. Returns nullopt if the text is not such an object, or the length of a row is not
/// columns.size().
std::optional<JsonRows> ReadJsonRows(std::string_view text);

}  // namespace legopt::db
