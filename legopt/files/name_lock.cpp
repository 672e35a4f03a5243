#include "legopt/files/name_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <string_view>

#include "legopt/files/written_file.h"

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

namespace {

// -1: there can be none.
int OpenLockOrNone(const std::filesystem::path& path) {
  try {
    return OpenLockFile(path);
  } catch (const FileError& error) {
    if (error.shortage()) throw;
    return -1;
  }
}

// The previous holder may have removed the file: a lock on it would protect nothing.
bool HasName(int descriptor, const std::filesystem::path& path) {
  struct stat by_descriptor {};
  struct stat by_name {};
  return ::fstat(descriptor, &by_descriptor) == 0 && ::stat(path.c_str(), &by_name) == 0 &&
         by_descriptor.st_ino == by_name.st_ino && by_descriptor.st_dev == by_name.st_dev;
}

std::string FirstLine(int descriptor) {
  std::array<char, 200> text{};
  const ssize_t size = ::pread(descriptor, text.data(), text.size(), 0);
  const std::string_view read(text.data(), size > 0 ? static_cast<std::size_t>(size) : 0);
  return std::string(read.substr(0, read.find('\n')));
}

// Information for the user: the lock does not depend on it.
void WriteHolder(int descriptor) {
  std::array<char, 100> host{};
  ::gethostname(host.data(), host.size() - 1);
  const std::string text = kLockFileBeginning + std::to_string(::getpid()) + " on " + host.data() + "\n";
  if (::pwrite(descriptor, text.data(), text.size(), 0) < 0) return;
  [[maybe_unused]] const int cut = ::ftruncate(descriptor, static_cast<off_t>(text.size()));
}

}  // namespace

NameLock::NameLock(const std::filesystem::path& name) : path_(name.string() + ".lock") {
  while (!TryToLock()) {
  }
}

NameLock::~NameLock() {
  if (descriptor_ < 0) return;
  ::unlink(path_.c_str());
  ::close(descriptor_);
}

// False: the file was removed meanwhile.
bool NameLock::TryToLock() {
  const int descriptor = OpenLockOrNone(path_);
  if (descriptor < 0) return true;
  if (::flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
    const int error = errno;
    if (error == EWOULDBLOCK) {
      holder_ = FirstLine(descriptor);
      if (holder_.empty()) holder_ = "another process";
    }
    ::close(descriptor);
    return error != EINTR;
  }
  if (!HasName(descriptor, path_)) {
    ::close(descriptor);
    return false;
  }
  WriteHolder(descriptor);
  descriptor_ = descriptor;
  return true;
}

}  // namespace legopt::files
