#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "legopt/types/read_guard.h"

namespace legopt::worker {

/// Cache of datasets from the network, by content: FOLDER/HASH. Files may have changed because of a full disk or a
/// user's mistake, so content is hashed before each use. Several workers may use one folder concurrently. Thread rule:
/// one thread.
class DatasetCache {
 public:
  /// The folder is created when the first dataset is added. `guard` runs the readers that use third-party libraries.
  DatasetCache(std::filesystem::path folder, ReadGuard guard);

  /// Hashes the cached dataset and returns its folder; empty if there is none. Removes it if its content has another
  /// hash.
  std::optional<std::filesystem::path> Find(const std::string& hash) const;
  /// Unpacks an archive and returns its folder. Throws InputError and keeps no files if the archive cannot be unpacked
  /// or its content has another hash.
  std::filesystem::path Add(const std::string& hash, const std::string& archive) const;

 private:
  std::filesystem::path folder_;
  ReadGuard guard_;
};

}  // namespace legopt::worker
