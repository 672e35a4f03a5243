#pragma once

#include <filesystem>
#include <string>

namespace legopt::client {

/// The name of a file that this program chose rather than the user, reserved by an empty file from the start: programs
/// that choose at the same time get different names. The destructor removes a file that is still empty.
class ClaimedName {
 public:
  /// STEM.EXTENSION, or the first of STEM-2.EXTENSION, STEM-3.EXTENSION, ... that does not exist. Throws
  /// files::FileError.
  ClaimedName(const std::string& stem, const std::string& extension);
  ~ClaimedName();
  ClaimedName(const ClaimedName&) = delete;
  ClaimedName& operator=(const ClaimedName&) = delete;

  const std::filesystem::path& path() const { return path_; }  ///< the file

 private:
  std::filesystem::path path_;
};

}  // namespace legopt::client
