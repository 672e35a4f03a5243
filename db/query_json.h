#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "db/read_only_database.h"

/// The JSON form of a query's result. The server sends it to its clients; a client that reads a file itself converts
/// the rows by the same functions, so that a result from a server and one from its file are equal.
namespace legopt::db {

/// A BLOB as upper-case hexadecimal digits, two for each byte, as SQL's hex() writes it.
std::string BlobText(std::string_view bytes);

/// The bytes of such a text, in upper or lower case. nullopt: not hexadecimal digits, or an odd number of them.
std::optional<std::string> ParseBlobText(std::string_view text);

/// A query's result with JSON scalars as cells: null, integer, real number or text. BLOBs are texts (BlobText).
struct JsonRows {
  std::vector<std::string> columns;
  std::vector<std::vector<nlohmann::json>> rows;  ///< each as long as `columns`
  bool truncated = false;                         ///< more rows existed than the limits allowed
};

/// Bytes in texts and in column names that are not UTF-8 are replaced by U+FFFD.
JsonRows ToJsonRows(const QueryResult& result);

/// One JSON object with "columns", "rows" and "truncated". An infinite number, for which JSON has no form, becomes the
/// object {"infinity": 1} or {"infinity": -1}.
std::string WriteJsonRows(JsonRows result);

/// The inverse of WriteJsonRows. nullopt: the text is not such an object, or a row has another length than `columns`.
std::optional<JsonRows> ReadJsonRows(std::string_view text);

}  // namespace legopt::db
