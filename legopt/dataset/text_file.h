#pragma once

#include <filesystem>
#include <string>

#include "files/name_lock.h"

namespace legopt {

/// Writes a text file whole or not at all (WriteOutputFile). Throws InputError.
void WriteTextFile(const std::filesystem::path& path, const std::string& text);

/// What happens to an unfinished folder of an earlier process.
enum class Unfinished {
  kKept,     ///< its files are kept, so that work can continue
  kRemoved,  ///< its files are removed
};

/// A folder that appears under its name only when it is complete.
///
/// Everything is written into `DIR.partial`, which Finish() renames and Discard() removes. One process at a time makes
/// it (files::NameLock). The constructor throws InputError when `DIR` exists (nothing is ever overwritten), when
/// another process makes `DIR`, and when `DIR.partial` was begun with another `identity`. With the same identity,
/// `unfinished` says what happens to the files in it. Throws files::FileError for a shortage.
class NewFolder {
 public:
  /// `folder` is DIR; `identity` is any text that names what is being made.
  NewFolder(const std::filesystem::path& folder, const std::string& identity, Unfinished unfinished);
  const std::filesystem::path& path() const { return partial_; }  ///< `DIR.partial`, where files go
  /// Gives the folder its name, in one step. Throws InputError when that fails; the files then stay in `DIR.partial`.
  void Finish();
  /// Removes `DIR.partial` with everything in it; never throws.
  void Discard();

 private:
  void Begin(const std::string& identity);

  std::filesystem::path folder_;
  std::filesystem::path partial_;
  files::NameLock lock_;
};

}  // namespace legopt
