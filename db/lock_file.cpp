#include "db/lock_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <string>

#include "db/store_error.h"

namespace legopt::db {
namespace {

std::string ReadHolder(int descriptor) {
  std::array<char, 200> text{};
  const ssize_t size = pread(descriptor, text.data(), text.size(), 0);
  std::string holder(text.data(), size > 0 ? static_cast<std::size_t>(size) : 0);
  while (!holder.empty() && holder.back() == '\n') holder.pop_back();
  return holder.empty() ? "unknown process" : holder;
}

void WriteHolder(int descriptor) {
  std::array<char, 100> host{};
  gethostname(host.data(), host.size() - 1);
  const std::string holder = "process " + std::to_string(getpid()) + " on " + host.data() + "\n";
  // For people only: the lock does not depend on it.
  if (ftruncate(descriptor, 0) != 0 || pwrite(descriptor, holder.data(), holder.size(), 0) < 0) return;
}

// The previous holder removes the file when it ends cleanly; a lock on a removed file protects nothing.
bool IsStillThere(int descriptor, const std::filesystem::path& path) {
  struct stat by_descriptor {};
  struct stat by_name {};
  return fstat(descriptor, &by_descriptor) == 0 && stat(path.c_str(), &by_name) == 0 &&
         by_descriptor.st_ino == by_name.st_ino && by_descriptor.st_dev == by_name.st_dev;
}

}  // namespace

LockFile::LockFile(const std::filesystem::path& path) : path_(path) {
  constexpr mode_t kMode = 0644;
  while (true) {
    descriptor_ = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, kMode);
    if (descriptor_ < 0) {
      throw StoreError(StoreErrorCode::kUnwritable, path.string() +
                                                        ": cannot create the lock file: " + std::strerror(errno) +
                                                        "; check that the folder exists and can be written");
    }
    if (flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
      const int error = errno;
      const std::string holder = ReadHolder(descriptor_);
      close(descriptor_);
      if (error == EINTR) continue;
      if (error == EWOULDBLOCK) {
        throw StoreError(StoreErrorCode::kLocked, path.string() + ": another legopt-server (" + holder +
                                                      ") works on this database; stop it or choose another file");
      }
      throw StoreError(StoreErrorCode::kUnwritable, path.string() + ": cannot lock: " + std::strerror(error) +
                                                        "; the database must be on a local disk");
    }
    if (IsStillThere(descriptor_, path)) break;
    close(descriptor_);
  }
  WriteHolder(descriptor_);
}

LockFile::~LockFile() {
  unlink(path_.c_str());
  close(descriptor_);
}

}  // namespace legopt::db
