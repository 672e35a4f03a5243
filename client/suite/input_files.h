#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "legopt/input_error.h"

namespace legopt::client {

/// The file that the user names for reading: "-" is standard input, /dev/stdin.
std::filesystem::path InputFile(const std::string& name);

/// A regular file with the content of a file that can be read only once (standard input, a pipe, <(COMMAND)), to be
/// read again or by other programs; the destructor removes it. A regular file is used as it is.
class RereadableFile {
 public:
  /// Reads `name` (see InputFile) to its end; a copy is made in `folder`. Throws InputError when it cannot be read,
  /// files::FileError when it cannot be copied.
  RereadableFile(const std::filesystem::path& name, const std::filesystem::path& folder);
  ~RereadableFile();
  RereadableFile(const RereadableFile&) = delete;
  RereadableFile& operator=(const RereadableFile&) = delete;

  const std::filesystem::path& path() const { return path_; }    ///< a regular file
  const std::filesystem::path& given() const { return given_; }  ///< the file that the user named

 private:
  std::filesystem::path given_;
  std::filesystem::path path_;
  bool copied_ = false;
};

/// Makes every file of `names` rereadable: its name is replaced by that of the copy. Copies are made in the working
/// directory, so that paths in them mean the same, and live as long as the result.
std::vector<std::unique_ptr<RereadableFile>> MakeRereadable(std::vector<std::filesystem::path>& names);

/// The same faults, with the files that the user named in place of their copies.
InputError WithGivenNames(const InputError& error, std::span<const std::unique_ptr<RereadableFile>> files);

/// Throws ClientError (kUsage) when more than one of `names` is standard input, which can be read only once.
void RequireOneStandardInput(std::span<const std::filesystem::path> names);

}  // namespace legopt::client
