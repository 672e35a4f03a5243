#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace legopt::app {

/// Folder of the running program (see ProgramFile). Throws InputError if it is unknown.
std::filesystem::path ProgramFolder();

/// Folder with the embedded datasets and suites: the environment variable LEGOPT_DATA, else ../share/legopt/data next
/// to the program (installed), else the link legopt-data next to it or its folder (built). Throws InputError if none
/// exists. `legopt --help` and `legopt service doctor` print it.
std::filesystem::path DataFolder();

/// Folder of legopt's Python package for PYTHONPATH, next to DataFolder(); empty if it was not installed.
std::filesystem::path PythonFolder();

/// Folder of the embedded default dataset, inside DataFolder(). Throws InputError like it.
std::filesystem::path DefaultDatasetFolder();

/// Folders of all embedded datasets for experiments, the default one first. A user's DataFolder() need not contain the
/// others. Throws InputError like it.
std::vector<std::filesystem::path> EmbeddedDatasetFolders();

/// Returns the folder that a user named: an existing folder, or the embedded dataset of that bare name
/// ("garage-hard"). Any other name is returned as it is. Throws InputError like DataFolder().
std::filesystem::path NamedDatasetFolder(const std::string& name);

/// Returns whether a text is a content hash of a dataset: 64 lower-case hexadecimal digits. Thread-safe.
bool IsDatasetHash(const std::string& text);

/// Folder of this user's dataset cache: $XDG_CACHE_HOME/legopt/datasets, else ~/.cache/legopt/datasets, else
/// legopt-UID/datasets in the folder for temporary files. Workers store fetched datasets there as FOLDER/HASH; the
/// content must be hashed again before use. Must be called before a process enters another user namespace.
std::filesystem::path DatasetCacheFolder();

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
