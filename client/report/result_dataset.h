#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "client/report/result_source.h"
#include "legopt/dataset/dataset.h"

namespace legopt::client {

/// @file
/// Locations of the datasets of this user's submissions by content hash: symbolic links in the user's cache, beside the
/// datasets fetched by workers (app/data_folder.h). They are used to find datasets of results whose
/// database does not contain them. Thread-safe.

/// Records that the dataset with this content hash is in `folder` (absolute path). Does nothing without a writable
/// cache, or for embedded datasets.
void RecordDatasetFolder(const std::string& hash, const std::filesystem::path& folder);

/// Returns the folder last recorded for this hash, if it still exists. Its contents may have changed: compute the hash.
std::optional<std::filesystem::path> RecordedDatasetFolder(const std::string& hash);

/// Finds the dataset with this content hash, in this order: an embedded dataset; one that a worker of this user has
/// fetched into the cache; the one stored with the results, unpacked into a temporary folder that exists as long as the
/// dataset; the folder of this user's last submission with that dataset. The content is always hashed: a stored archive
/// with other content, or an unreadable one, is ignored with a warning on standard error. Returns nullptr if the
/// dataset is not found. Throws ClientError if no temporary folder can be created.
std::shared_ptr<const Dataset> FindResultDataset(ResultSource& source, const std::string& hash);

/// Finds the dataset with this content hash as FindResultDataset does, but without results: an embedded one, the folder
/// of this user's last submission with it, one that a worker of this user has fetched, or any other one in the data
/// folder. Returns nullptr if there is none.
std::shared_ptr<const Dataset> FindLocalDataset(const std::string& hash);

}  // namespace legopt::client
