#pragma once

#include <filesystem>
#include <string>

namespace legopt::client {

/// A dataset's archive in a folder that a server hands out (programs/offered_datasets.h).
struct PackedDataset {
  std::string hash;
  std::filesystem::path archive;
};

/// Packs the dataset in `folder` into `out`, which is made when it is missing; an archive that is there already is
/// replaced in one step. Throws InputError, also for one that is too large to travel, and ClientError (kUsage) for a
/// folder that cannot be written.
PackedDataset PackInto(const std::filesystem::path& folder, const std::filesystem::path& out);

/// A temporary folder with one packed dataset, for a server of our own; removed by the destructor.
class OfferedFolder {
 public:
  /// Throws as PackInto.
  explicit OfferedFolder(const std::filesystem::path& dataset);
  ~OfferedFolder();
  OfferedFolder(const OfferedFolder&) = delete;
  OfferedFolder& operator=(const OfferedFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace legopt::client
