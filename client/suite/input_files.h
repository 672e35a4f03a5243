#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/suite/suite.h"
#include "legopt/types/input_error.h"

namespace legopt::client {

/// Returns the input file that the user named: "-" is standard input, /dev/stdin.
std::filesystem::path InputFile(const std::string& name);

/// A regular file with the contents of a file that can be read only once (standard input, a pipe, <(COMMAND)), so that
/// it can be read again, also by other programs; the destructor removes it. A regular file is used directly.
class RereadableFile {
 public:
  /// Reads `name` (see InputFile) to its end; the copy is created in `folder`. Throws InputError if it cannot be read,
  /// files::FileError if it cannot be copied.
  RereadableFile(const std::filesystem::path& name, const std::filesystem::path& folder);
  ~RereadableFile();
  RereadableFile(const RereadableFile&) = delete;
  RereadableFile& operator=(const RereadableFile&) = delete;

  const std::filesystem::path& path() const { return path_; }    ///< a regular file
  const std::filesystem::path& given() const { return given_; }  ///< file named by the user

 private:
  std::filesystem::path given_;
  std::filesystem::path path_;
  bool copied_ = false;
};

/// Makes every file of `names` rereadable; its name is replaced by that of the copy. Copies are created in the working
/// directory, so that relative paths in them stay valid, and live as long as the result.
std::vector<std::unique_ptr<RereadableFile>> MakeRereadable(std::vector<std::filesystem::path>& names);

/// Returns the same diagnostics with the user's file names instead of the copies.
InputError WithGivenNames(const InputError& error, std::span<const std::unique_ptr<RereadableFile>> files);

/// Throws ClientError (kUsage) if more than one of `names` is standard input, which can be read only once.
void RequireOneStandardInput(std::span<const std::filesystem::path> names);

/// Returns the path of the suite that the user named: a readable file or pipe, "-" for standard input, or the bare name
/// of an embedded suite ("quick" for data/suites/quick.yaml). Throws ClientError (kUsage) that lists the embedded
/// suites.
std::filesystem::path FindSuite(const std::string& name);

/// Returns the dataset to use: `flag` if given (a folder, or the bare name of an embedded dataset such as
/// "garage-hard"), else the suite's, else the embedded default.
std::filesystem::path ChooseDatasetFolder(const std::optional<std::string>& flag, const Suite* suite);

}  // namespace legopt::client
