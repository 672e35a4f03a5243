#pragma once

#include <filesystem>
#include <string>

namespace legopt::files {

/// Opens a lock file for reading and writing, or creates it (0644 before the umask); the caller closes the descriptor.
///
/// Refuses, without changing it, a path that cannot be a lock file of this program: a symbolic link, anything but a
/// regular file, a file of another user except root, a file with further hard links, a file whose content does not
/// begin with kLockFileBeginning. Throws FileError.
int OpenLockFile(const std::filesystem::path& path);

/// Beginning of the text in a lock file.
inline constexpr char kLockFileBeginning[] = "process ";

/// Exclusive right of a process to write a file or folder, for example a folder that is made in steps. The lock is an
/// flock on the file `<name>.lock` beside it. The destructor releases the lock and removes the file; the kernel
/// releases it if the process is killed. Not thread-safe.
///
/// Nothing is locked if the file system has no locks, the folder is not writable, or `<name>.lock` is not a lock file
/// of legopt (OpenLockFile). Writing the file or folder then reports the cause.
class NameLock {
 public:
  /// Throws FileError for a lack of resources (IsShortage) only.
  explicit NameLock(const std::filesystem::path& name);
  ~NameLock();
  NameLock(const NameLock&) = delete;
  NameLock& operator=(const NameLock&) = delete;

  /// Returns the process that holds the lock instead, "process 12 on host"; empty if this object holds it.
  const std::string& holder() const { return holder_; }

 private:
  bool TryToLock();

  std::filesystem::path path_;
  std::string holder_;
  int descriptor_ = -1;
};

}  // namespace legopt::files
