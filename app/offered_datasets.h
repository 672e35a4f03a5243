#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace legopt::app {

/// Returns the name of the archive file of a dataset with this content hash.
std::string ArchiveName(std::string_view hash);

/// Archives that a server offers: files in one folder, named ArchiveName(hash). Requests are compared with the existing
/// names and never used as paths. Only the most recently requested archive is kept in memory. Thread rule: one thread.
class OfferedDatasets {
 public:
  /// Empty folder: no archives. Throws InputError if the folder does not exist.
  explicit OfferedDatasets(std::optional<std::filesystem::path> folder);

  /// Returns an archive; null if it does not exist, cannot be read, or is larger than `most_bytes`. Valid until the
  /// next call.
  const std::string* Find(const std::string& hash, std::size_t most_bytes);

 private:
  std::optional<std::filesystem::path> folder_;
  std::string hash_, archive_;
};

}  // namespace legopt::app
