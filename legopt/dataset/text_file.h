#pragma once

#include <filesystem>
#include <string>

namespace legopt {

/// Writes a text file atomically (WriteOutputFile). Throws InputError.
void WriteTextFile(const std::filesystem::path& path, const std::string& text);

/// An output folder that appears under its name only when it is complete.
///
/// Files are written into `DIR.partial`, which Finish() renames and Discard() removes. The constructor throws
/// InputError if `DIR` exists (nothing is ever overwritten), or if `DIR.partial` exists with another `identity`. With
/// the same identity its files are kept, so that interrupted work can be resumed.
class NewFolder {
 public:
  /// `folder`: DIR. `identity`: any text that identifies the content.
  NewFolder(const std::filesystem::path& folder, const std::string& identity);
  const std::filesystem::path& path() const { return partial_; }  ///< `DIR.partial`, the folder for the files
  /// Renames the folder atomically. Throws InputError if that fails; the files then remain in `DIR.partial`.
  void Finish();
  /// Removes `DIR.partial` and its content; never throws.
  void Discard();

 private:
  std::filesystem::path folder_;
  std::filesystem::path partial_;
};

}  // namespace legopt
