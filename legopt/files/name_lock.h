#pragma once

#include <filesystem>
#include <string>

namespace legopt::files {

/// The right to write what has a name, for example a folder that is made in steps: held while this object lives, by
/// flock on a file `<name>.lock` beside it. The kernel releases it however the process ends; a clean end removes the
/// file. Not thread-safe.
///
/// Nothing is locked where the file system has no locks, where the folder cannot be written, or where `<name>.lock` is
/// no lock file of legopt (OpenLockFile). Writing the thing itself then reports the cause.
class NameLock {
 public:
  /// Throws FileError for a shortage (IsShortage) only.
  explicit NameLock(const std::filesystem::path& name);
  ~NameLock();
  NameLock(const NameLock&) = delete;
  NameLock& operator=(const NameLock&) = delete;

  /// The process that has the right instead, "process 12 on host"; empty: this object has it.
  const std::string& holder() const { return holder_; }

 private:
  bool TryToLock();

  std::filesystem::path path_;
  std::string holder_;
  int descriptor_ = -1;
};

}  // namespace legopt::files
