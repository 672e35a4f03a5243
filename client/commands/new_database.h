#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace legopt::client {

/// The database of a run. A name that this program chooses is reserved by an empty file from the start, so that
/// programs that choose at the same time get different ones. The destructor removes a file that did not exist before if
/// no server uses it and it holds no experiment.
class NewDatabase {
 public:
  /// `named` is the user's choice. Without one: STEM.sqlite, or the first of STEM-2.sqlite, STEM-3.sqlite, ... that
  /// does not exist. Throws files::FileError.
  NewDatabase(const std::optional<std::string>& named, const std::string& stem);
  ~NewDatabase();
  NewDatabase(const NewDatabase&) = delete;
  NewDatabase& operator=(const NewDatabase&) = delete;

  const std::filesystem::path& path() const { return path_; }  ///< the file

 private:
  std::filesystem::path path_;
  bool created_ = false;
};

}  // namespace legopt::client
