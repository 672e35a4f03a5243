#include "db/foreign_keys.h"

#include "db/connection.h"

namespace legopt::db {

BrokenForeignKeys FindBrokenForeignKeys(Connection& connection, std::string_view table) {
  const std::string argument = table.empty() ? "" : "(" + std::string(table) + ")";
  Statement check(connection, "PRAGMA foreign_key_check" + argument, false);
  BrokenForeignKeys broken;
  while (check.Step()) {
    if (broken.rows++ > 0) continue;
    broken.first = "a row refers to one that does not exist: table " + check.column_text(0) + ", row " +
                   (check.column_type(1) == Statement::Type::kNull ? "?" : std::to_string(check.column_int(1))) +
                   ", into " + check.column_text(2);
  }
  return broken;
}

}  // namespace legopt::db
