#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "legopt/read_guard.h"

namespace legopt::worker {

/// Datasets that came over the network, by content: FOLDER/HASH. A full disk or a careless hand may have changed them,
/// so nothing in it is believed that was not hashed again. Several workers may use one folder at the same time. Thread
/// rule: one thread.
class DatasetCache {
 public:
  /// Made when the first dataset comes. `guard` runs the readers of others' libraries.
  DatasetCache(std::filesystem::path folder, ReadGuard guard);

  /// The folder of the dataset with this content, hashed now; empty when there is none. One with other content is
  /// removed.
  std::optional<std::filesystem::path> Find(const std::string& hash) const;
  /// Unpacks an archive and returns its folder. Throws InputError when the archive cannot be unpacked or holds other
  /// content than its name says; nothing of it is kept then.
  std::filesystem::path Add(const std::string& hash, const std::string& archive) const;

 private:
  std::filesystem::path folder_;
  ReadGuard guard_;
};

}  // namespace legopt::worker
