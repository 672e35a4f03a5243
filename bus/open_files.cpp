#include "bus/open_files.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <charconv>
#include <cstring>

namespace legopt::bus {
namespace {

// Fallback without /proc. New descriptors get the lowest free numbers, so all open ones are below a new one, except for
// gaps.
std::set<int> DescriptorsByTrial() {
  constexpr int kGaps = 64;
  std::set<int> descriptors;
  const int lowest_free = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  if (lowest_free < 0) return descriptors;
  ::close(lowest_free);
  for (int fd = 0; fd < lowest_free + kGaps; ++fd) descriptors.insert(fd);
  return descriptors;
}

std::set<int> Descriptors() {
  DIR* folder = ::opendir("/proc/self/fd");
  if (folder == nullptr) return DescriptorsByTrial();
  std::set<int> descriptors;
  while (const dirent* entry = ::readdir(folder)) {
    int fd = 0;
    const char* end = entry->d_name + std::strlen(entry->d_name);
    if (std::from_chars(entry->d_name, end, fd).ptr == end) descriptors.insert(fd);
  }
  ::closedir(folder);
  return descriptors;
}

}  // namespace

std::map<int, FileIdentity> OpenSocketsAndPipes() {
  std::map<int, FileIdentity> files;
  for (const int fd : Descriptors()) {
    struct stat status {};
    if (::fstat(fd, &status) != 0 || (!S_ISSOCK(status.st_mode) && !S_ISFIFO(status.st_mode))) continue;
    files[fd] = {status.st_dev, status.st_ino};
  }
  return files;
}

OpenFilesBefore::OpenFilesBefore() {
  for (const auto& [fd, file] : OpenSocketsAndPipes()) files_.insert(file);
}

std::set<int> OpenFilesBefore::OpenedSince() const {
  std::set<int> descriptors;
  for (const auto& [fd, file] : OpenSocketsAndPipes()) {
    if (!files_.contains(file)) descriptors.insert(fd);
  }
  return descriptors;
}

}  // namespace legopt::bus
