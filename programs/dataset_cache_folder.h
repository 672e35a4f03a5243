#pragma once

#include <filesystem>
#include <string>

namespace legopt::programs {

/// Whether a text is the content hash of a dataset: 64 lower-case hexadecimal digits. Thread-safe.
bool IsDatasetHash(const std::string& text);

/// The folder of this user's dataset cache: $XDG_CACHE_HOME/legopt/datasets, else ~/.cache/legopt/datasets; where there
/// is neither, legopt-UID/datasets in the folder for temporary files. Workers keep datasets there that they fetched, as
/// FOLDER/HASH; the content has to be hashed again before use. To be asked before a process leaves its user namespace.
std::filesystem::path DatasetCacheFolder();

}  // namespace legopt::programs
