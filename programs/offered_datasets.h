#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace legopt::programs {

/// How the file is called that holds the archive of a dataset with this content hash.
std::string ArchiveName(std::string_view hash);

/// The archives that a server hands out: files of one folder, called ArchiveName(hash). What is asked for is compared
/// with the names that are there; no path is made of it. Only the last archive that was asked for is kept in memory.
/// Thread rule: one thread.
class OfferedDatasets {
 public:
  /// Empty: none. Throws InputError when there is no such folder.
  explicit OfferedDatasets(std::optional<std::filesystem::path> folder);

  /// Null when it is not there, cannot be read, or is larger than `most_bytes`. Valid until the next call.
  const std::string* Find(const std::string& hash, std::size_t most_bytes);

 private:
  std::optional<std::filesystem::path> folder_;
  std::string hash_, archive_;
};

}  // namespace legopt::programs
