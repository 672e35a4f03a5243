#pragma once

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "db/connection.h"
#include "tests/folders.h"

namespace legopt::db {

/// Writes the database of a released schema version to `path`, as that release left it on disk.
inline void MakeReleased(int version, const std::filesystem::path& path) {
  std::ifstream file(SourceFolder() + "/tests/db/fixtures/version_" + std::to_string(version) + ".sql");
  std::ostringstream text;
  text << file.rdbuf();
  Connection connection(path, Connection::Mode::kReadWriteCreate);
  connection.Execute(text.str());
  connection.QueryText("PRAGMA journal_mode = WAL");
}

}  // namespace legopt::db
