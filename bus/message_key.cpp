#include "bus/message_key.h"

#include <fcntl.h>
#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "bus/bus_error.h"
#include "bus/wire.h"

namespace legopt::bus {
namespace {

constexpr std::size_t kDigits = 2 * MessageKey::kBytes;
constexpr std::size_t kMostFileBytes = kDigits + 2;  // digits, CR, LF

[[noreturn]] void Refuse(const std::string& file, const std::string& fault) {
  throw BusError(BusErrorCode::kInvalidOption, "key file \"" + file + "\": " + fault);
}

std::string Reason() { return std::strerror(errno); }

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

// Text that held a secret.
struct SecretText {
  std::array<char, kMostFileBytes + 1> bytes{};
  ~SecretText() { sodium_memzero(bytes.data(), bytes.size()); }
};

void CheckWhoMayRead(const std::string& file, int fd) {
  struct stat status {};
  if (::fstat(fd, &status) != 0) Refuse(file, "cannot be examined: " + Reason());
  if (!S_ISREG(status.st_mode)) Refuse(file, "is not a regular file");
  if (status.st_uid != ::geteuid() && status.st_uid != 0) {
    Refuse(file, "belongs to user " + std::to_string(status.st_uid) + "; it must be yours: chown it");
  }
  if ((status.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    Refuse(file, "is open to others; only its owner may read it: chmod 600 '" + file + "'");
  }
}

std::size_t ReadAll(const std::string& file, int fd, std::span<char> text) {
  std::size_t size = 0;
  while (size < text.size()) {
    const ssize_t got = ::read(fd, text.data() + size, text.size() - size);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) Refuse(file, "cannot be read: " + Reason());
    if (got == 0) break;
    size += static_cast<std::size_t>(got);
  }
  return size;
}

std::size_t WithoutLineEnd(std::span<const char> text) {
  std::size_t size = text.size();
  if (size > 0 && text[size - 1] == '\n') --size;
  if (size < text.size() && size > 0 && text[size - 1] == '\r') --size;
  return size;
}

void WriteAll(const std::string& file, int fd, std::span<const char> text) {
  while (!text.empty()) {
    const ssize_t put = ::write(fd, text.data(), text.size());
    if (put < 0 && errno == EINTR) continue;
    if (put <= 0) Refuse(file, "cannot be written: " + Reason());
    text = text.subspan(static_cast<std::size_t>(put));
  }
  if (::fsync(fd) != 0) Refuse(file, "cannot be written: " + Reason());
}

}  // namespace

MessageKey::MessageKey(std::span<const std::uint8_t, kBytes> bytes) {
  std::copy(bytes.begin(), bytes.end(), bytes_.begin());
}

MessageKey::~MessageKey() { sodium_memzero(bytes_.data(), bytes_.size()); }

std::shared_ptr<const MessageKey> MessageKey::Load(const std::string& file) {
  PrepareHashing();
  // Without blocking: a pipe would wait for a writer before it can be refused.
  const Descriptor fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  if (fd.get() < 0) Refuse(file, "cannot be opened: " + Reason() + "; make one: legopt keygen FILE");
  CheckWhoMayRead(file, fd.get());
  SecretText text;
  const std::size_t size = WithoutLineEnd({text.bytes.data(), ReadAll(file, fd.get(), text.bytes)});
  std::array<std::uint8_t, kBytes> bytes{};
  std::size_t decoded = 0;
  const bool legal = size == kDigits && sodium_hex2bin(bytes.data(), bytes.size(), text.bytes.data(), size, nullptr,
                                                       &decoded, nullptr) == 0;
  if (!legal || decoded != kBytes) {
    Refuse(file, "must hold exactly 64 hexadecimal digits and a line end; make one: legopt keygen FILE");
  }
  auto key = std::make_shared<const MessageKey>(std::span<const std::uint8_t, kBytes>(bytes));
  sodium_memzero(bytes.data(), bytes.size());
  return key;
}

void MessageKey::CreateFile(const std::string& file) {
  PrepareHashing();
  const Descriptor fd(::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, S_IRUSR | S_IWUSR));
  if (fd.get() < 0) {
    Refuse(file, errno == EEXIST ? "exists already and is not overwritten" : "cannot be created: " + Reason());
  }
  std::array<std::uint8_t, kBytes> bytes{};
  randombytes_buf(bytes.data(), bytes.size());
  SecretText text;
  sodium_bin2hex(text.bytes.data(), text.bytes.size(), bytes.data(), bytes.size());
  sodium_memzero(bytes.data(), bytes.size());
  text.bytes[kDigits] = '\n';
  WriteAll(file, fd.get(), {text.bytes.data(), kDigits + 1});
}

}  // namespace legopt::bus
