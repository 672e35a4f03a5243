#include "legopt/input/file_text.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>

#include "legopt/types/input_error.h"

namespace legopt {
namespace {

[[noreturn]] void RefuseUnreadable(const std::filesystem::path& path, int error) {
  if (error == EMFILE || error == ENFILE || error == ENOMEM) {
    throw std::system_error(error, std::generic_category(), path.string());
  }
  const bool folder = error == EISDIR;
  throw InputError({path.string(), "", "",
                    folder ? "cannot be read: it is a folder" : std::string("cannot be read: ") + std::strerror(error),
                    folder ? "name a file in it" : "check that the file exists and is readable"});
}

class OpenFile {
 public:
  explicit OpenFile(const std::filesystem::path& path) : fd_(::open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
    if (fd_ < 0) RefuseUnreadable(path, errno);
  }
  ~OpenFile() { ::close(fd_); }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;

  int fd() const { return fd_; }

 private:
  int fd_;
};

}  // namespace

std::string ReadFileText(const std::filesystem::path& path, std::size_t most_bytes) {
  constexpr std::size_t kBlock = std::size_t{1} << 16;
  const OpenFile file(path);
  std::string text;
  for (std::size_t used = 0;;) {
    text.resize(std::max(text.size(), std::min(used + std::max(used, kBlock), most_bytes + 1)));
    const ssize_t count = ::read(file.fd(), text.data() + used, text.size() - used);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) RefuseUnreadable(path, errno);
    used += static_cast<std::size_t>(count);
    if (used > most_bytes) {
      throw InputError({path.string(), "", "", "is larger than " + std::to_string(most_bytes >> 10U) + " KiB",
                        "no file of this kind is that large; check that it is the right one"});
    }
    if (count == 0) {
      text.resize(used);
      return text;
    }
  }
}

}  // namespace legopt
