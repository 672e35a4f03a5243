#include "legopt/files/name_lock.h"

#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <string_view>

#include "legopt/files/file_error.h"
#include "legopt/files/lock_file.h"

namespace legopt::files {
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
