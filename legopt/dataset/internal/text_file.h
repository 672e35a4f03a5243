#pragma once

#include <filesystem>
#include <string>

#include "legopt/files/name_lock.h"

namespace legopt {

/// Writes a text file atomically (WriteOutputFile). Throws InputError.
void WriteTextFile(const std::filesystem::path& path, const std::string& text);

/// Treatment of an unfinished folder of an earlier process.
enum class Unfinished {
  kKept,     ///< its files are kept, so that interrupted work can be resumed
  kRemoved,  ///< its files are removed
};

/// An output folder that appears under its name only when it is complete.
///
/// Files are written into `DIR.partial`, which Finish() renames and Discard() removes. Only one process at a time can
/// do this (files::NameLock). The constructor throws InputError if `DIR` exists (nothing is ever overwritten), if
/// another process writes `DIR`, or if `DIR.partial` exists with another `identity`. With the same identity,
/// `unfinished` decides about its files. Throws files::FileError for a lack of resources.
class StagedFolder {
 public:
  /// `folder`: DIR. `identity`: any text that identifies the content.
  StagedFolder(const std::filesystem::path& folder, const std::string& identity, Unfinished unfinished);
  const std::filesystem::path& path() const { return partial_; }  ///< `DIR.partial`, the folder for the files
  /// Renames the folder atomically. Throws InputError if that fails; the files then remain in `DIR.partial`.
  void Finish();
  /// Removes `DIR.partial` and its content; never throws.
  void Discard();

 private:
  void Begin(const std::string& identity);

  std::filesystem::path folder_;
  std::filesystem::path partial_;
  files::NameLock lock_;
};

}  // namespace legopt
