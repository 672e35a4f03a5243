#include "db/file_system.h"

#include <sys/vfs.h>

#include <algorithm>
#include <array>
#include <system_error>

namespace legopt::db {
namespace {

struct FileSystem {
  std::int64_t type;
  std::string_view name;
};

// Magic numbers from <linux/magic.h> or, if not listed there, from the file system's sources.
constexpr std::array<FileSystem, 13> kUnsupportedFileSystems = {{
    {0x6969, "NFS"},
    {0x517b, "SMB"},
    {0xfe534d42, "SMB"},
    {0xff534d42, "SMB (CIFS)"},
    {0x0bd00bd0, "Lustre"},
    {0x47504653, "GPFS (Spectrum Scale)"},
    {0x19830326, "BeeGFS"},
    {0x00c36400, "Ceph"},
    {0x5346414f, "AFS"},
    {0xaad7aaea, "PanFS"},
    {0x7461636f, "OCFS2"},
    {0x01021997, "9P"},
    {0x65735546, "FUSE"},
}};

}  // namespace

std::optional<std::string_view> UnsupportedFileSystemName(std::int64_t type) {
  const auto found = std::find_if(kUnsupportedFileSystems.begin(), kUnsupportedFileSystems.end(),
                                  [type](const auto& row) { return row.type == type; });
  return found == kUnsupportedFileSystems.end() ? std::nullopt : std::optional(found->name);
}

std::optional<std::int64_t> FileSystemOf(const std::filesystem::path& file) {
  struct statfs system {};
  std::error_code error;
  const std::filesystem::path folder = std::filesystem::absolute(file, error).parent_path();
  if (statfs(file.c_str(), &system) != 0 && statfs(folder.c_str(), &system) != 0) return std::nullopt;
  constexpr std::int64_t kWord = 0xffffffff;  // some kernels return a signed number
  return static_cast<std::int64_t>(system.f_type) & kWord;
}

std::optional<DiskSpace> SpaceAt(const std::filesystem::path& file) {
  std::error_code error;
  const std::filesystem::space_info space = std::filesystem::space(file, error);
  if (error) return std::nullopt;
  return DiskSpace{static_cast<std::int64_t>(space.available), static_cast<std::int64_t>(space.capacity)};
}

}  // namespace legopt::db
