#pragma once

#include <filesystem>
#include <optional>
#include <string>

/// @file
/// Locations of the datasets of this user's submissions by content hash: symbolic links in the user's cache, beside the
/// datasets fetched by workers (app/dataset_cache_folder.h). They are used to find datasets of results whose
/// database does not contain them. Thread-safe.

namespace legopt::client {

/// Records that the dataset with this content hash is in `folder` (absolute path). Does nothing without a writable
/// cache, or for embedded datasets.
void RecordDatasetFolder(const std::string& hash, const std::filesystem::path& folder);

/// Returns the folder last recorded for this hash, if it still exists. Its contents may have changed: compute the hash.
std::optional<std::filesystem::path> RecordedDatasetFolder(const std::string& hash);

}  // namespace legopt::client
