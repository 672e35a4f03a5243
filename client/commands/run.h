#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace legopt::client {

/// The database of a run. An automatically chosen name is reserved by creating an empty file, so that simultaneous runs
/// get different names. The destructor removes a file that did not exist before if no server uses it and it contains no
/// experiment.
class NewDatabase {
 public:
  /// `named` is the user's choice. Without it: STEM.sqlite, or the first of STEM-2.sqlite, STEM-3.sqlite, ... that does
  /// not exist. Throws files::FileError.
  NewDatabase(const std::optional<std::string>& named, const std::string& stem);
  ~NewDatabase();
  NewDatabase(const NewDatabase&) = delete;
  NewDatabase& operator=(const NewDatabase&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  bool created_ = false;
};

}  // namespace legopt::client
