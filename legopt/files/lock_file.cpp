#include "legopt/files/lock_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <string_view>

#include "legopt/files/file_error.h"

namespace legopt::files {
namespace {

constexpr mode_t kMode = 0644;
constexpr off_t kMostBytes = 4096;  // size limit
constexpr const char* kNoLockFile = "is no lock file of legopt and is left alone; remove it, or name another database";

// Returns why the file cannot be a lock file; null if it can be one.
const char* WhyNoLockFile(int fd) {
  struct stat status {};
  if (::fstat(fd, &status) != 0 || !S_ISREG(status.st_mode)) return kNoLockFile;
  if (status.st_uid != ::geteuid() && status.st_uid != 0) return "belongs to another user";
  // A link count of 0 means that the last holder has just removed the file.
  if (status.st_nlink > 1) return "has further hard links and is left alone; remove it";
  if (status.st_size == 0) return nullptr;
  constexpr std::string_view kBeginning = kLockFileBeginning;
  std::array<char, kBeginning.size()> found{};
  const ssize_t count = ::pread(fd, found.data(), found.size(), 0);
  const bool ours = count > 0 && std::string_view(found.data(), static_cast<std::size_t>(count)) == kBeginning;
  // A holder that has just truncated the file is about to write to it.
  return count == 0 || (ours && status.st_size <= kMostBytes) ? nullptr : kNoLockFile;
}

}  // namespace

int OpenLockFile(const std::filesystem::path& path) {
  const int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, kMode);
  if (fd < 0) {
    throw FileError(path, errno == ELOOP ? "is a symbolic link and is left alone; remove it" : "cannot be created",
                    errno);
  }
  if (const char* why = WhyNoLockFile(fd); why != nullptr) {
    ::close(fd);
    throw FileError(path, why, EPERM);
  }
  return fd;
}

}  // namespace legopt::files
