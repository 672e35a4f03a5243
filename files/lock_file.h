#pragma once

#include <filesystem>

namespace legopt::files {

/// Opens a lock file for reading and writing, or creates it (0644 before the umask); the caller closes the descriptor.
///
/// Refuses what can be no lock file of this program, without changing it: a symbolic link, anything but a regular file,
/// a file of another user (but root), a file with further hard links, a file with other content than
/// kLockFileBeginning. Throws FileError.
int OpenLockFile(const std::filesystem::path& path);

/// How the text of a lock file begins.
inline constexpr char kLockFileBeginning[] = "process ";

}  // namespace legopt::files
