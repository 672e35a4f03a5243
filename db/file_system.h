#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>

namespace legopt::db {

/// The name of a file system on which a database does not survive, by the kernel's number for its type (statfs(2)):
/// those of networks and clusters, and those that programs serve (FUSE). SQLite's write-ahead log needs memory that
/// all who open the file share, and locks that are kept; there is neither, or not for sure. Empty: none of these.
std::optional<std::string_view> UnfitFileSystem(std::int64_t type);

/// The type of the file system that a file is on, or, when there is none yet, would be; empty when nobody knows.
std::optional<std::int64_t> FileSystemOf(const std::filesystem::path& file);

/// Room on a file system, as an unprivileged user sees it.
struct DiskSpace {
  std::int64_t free_bytes = 0, total_bytes = 0;
};

/// Of the file system that a file is on; empty when the system does not tell.
std::optional<DiskSpace> SpaceAt(const std::filesystem::path& file);

}  // namespace legopt::db
