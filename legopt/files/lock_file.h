#pragma once

#include <filesystem>

namespace legopt::files {

/// Opens a lock file for reading and writing, or creates it (0644 before the umask); the caller closes the descriptor.
///
/// Refuses, without changing it, a path that cannot be a lock file of this program: a symbolic link, anything but a
/// regular file, a file of another user except root, a file with further hard links, a file whose content does not
/// begin with kLockFileBeginning. Throws FileError.
int OpenLockFile(const std::filesystem::path& path);

/// Beginning of the text in a lock file.
inline constexpr char kLockFileBeginning[] = "process ";

}  // namespace legopt::files
