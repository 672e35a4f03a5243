#pragma once

#include <filesystem>
#include <optional>
#include <string>

/// @file
/// Where the datasets of this user's submissions are, by content hash: symbolic links in the user's cache, beside the
/// datasets that workers have fetched (programs/dataset_cache_folder.h). They find the dataset of results whose
/// database does not contain it. Thread-safe.

namespace legopt::client {

/// Records that the dataset with this content hash is in `folder` (absolute). Without a writable cache nothing is
/// recorded; embedded datasets need no record.
void RecordDatasetFolder(const std::string& hash, const std::filesystem::path& folder);

/// The folder recorded last for this hash, if it still exists. Its content may have changed: compute its hash.
std::optional<std::filesystem::path> RecordedDatasetFolder(const std::string& hash);

}  // namespace legopt::client
