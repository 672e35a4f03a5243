#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>

namespace legopt::db {

/// Returns the name of a file system that is not safe for databases, given its type (statfs(2)): network and cluster
/// file systems and FUSE. SQLite's write-ahead log needs shared memory between all processes that open the file, and
/// reliable locks; these file systems do not guarantee both. Returns nullopt for all other types.
std::optional<std::string_view> UnsupportedFileSystemName(std::int64_t type);

/// Returns the type of the file system of a file (for a new file, of its folder); nullopt if unknown.
std::optional<std::int64_t> FileSystemOf(const std::filesystem::path& file);

/// Disk space of a file system available to an unprivileged user.
struct DiskSpace {
  std::int64_t free_bytes = 0, total_bytes = 0;
};

/// Returns the disk space of a file's file system; nullopt if unknown.
std::optional<DiskSpace> SpaceAt(const std::filesystem::path& file);

}  // namespace legopt::db
