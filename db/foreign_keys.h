#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace legopt::db {

class Connection;

/// Rows of a database that refer to rows which do not exist.
struct BrokenForeignKeys {
  std::int64_t rows = 0;
  std::string first;  ///< "a row refers to one that does not exist: table cells, row 3, into methods"; empty if none
};

/// Checks the foreign keys of one table, or of all tables if `table` is empty. Reads every row of the table, and looks
/// up a row for each of its references.
BrokenForeignKeys FindBrokenForeignKeys(Connection& connection, std::string_view table = {});

}  // namespace legopt::db
