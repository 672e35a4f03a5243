#pragma once

#include <filesystem>
#include <string>

namespace legopt::client {

/// A dataset archive in a folder of datasets that a server offers (app/data_folder.h).
struct PackedDataset {
  std::string hash;
  std::filesystem::path archive;
};

/// Packs the dataset in `folder` into `out`, which is created if missing; an existing archive is replaced atomically.
/// Throws InputError, also if the dataset is too large to be transferred, and ClientError (kUsage) if `out` cannot be
/// written.
PackedDataset PackInto(const std::filesystem::path& folder, const std::filesystem::path& out);

/// A temporary folder with one packed dataset, for the server of a command; removed by the destructor.
class OfferedFolder {
 public:
  /// Throws the errors of PackInto.
  explicit OfferedFolder(const std::filesystem::path& dataset);
  ~OfferedFolder();
  OfferedFolder(const OfferedFolder&) = delete;
  OfferedFolder& operator=(const OfferedFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace legopt::client
