#pragma once

#include <filesystem>
#include <string>

namespace legopt {

/// Writes a text file whole or not at all (WriteOutputFile). Throws InputError.
void WriteTextFile(const std::filesystem::path& path, const std::string& text);

/// A folder that appears under its name only when it is complete.
///
/// Everything is written into `DIR.partial`, which Finish() renames and Discard() removes. The constructor throws
/// InputError when `DIR` exists (nothing is ever overwritten), and when `DIR.partial` is there but was begun with
/// another `identity`; with the same identity its files are kept, so that work can go on where it stopped.
class NewFolder {
 public:
  /// `folder` is DIR; `identity` is any text that names what is being made.
  NewFolder(const std::filesystem::path& folder, const std::string& identity);
  const std::filesystem::path& path() const { return partial_; }  ///< `DIR.partial`, where files go
  /// Gives the folder its name, in one step. Throws InputError when that fails; the files then stay in `DIR.partial`.
  void Finish();
  /// Removes `DIR.partial` with everything in it; never throws.
  void Discard();

 private:
  std::filesystem::path folder_;
  std::filesystem::path partial_;
};

}  // namespace legopt
