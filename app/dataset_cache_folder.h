#pragma once

#include <filesystem>
#include <string>

namespace legopt::app {

/// Returns whether a text is a content hash of a dataset: 64 lower-case hexadecimal digits. Thread-safe.
bool IsDatasetHash(const std::string& text);

/// Folder of this user's dataset cache: $XDG_CACHE_HOME/legopt/datasets, else ~/.cache/legopt/datasets, else
/// legopt-UID/datasets in the folder for temporary files. Workers store fetched datasets there as FOLDER/HASH; the
/// content must be hashed again before use. Must be called before a process enters another user namespace.
std::filesystem::path DatasetCacheFolder();

}  // namespace legopt::app
