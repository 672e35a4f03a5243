#include "bus/message_key.h"

#include <fcntl.h>
#include <sodium.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>
#include <system_error>

#include "bus/bus_error.h"
#include "bus/wire.h"
#include "legopt/files/written_file.h"

namespace legopt::bus {

std::string RoleRefusal(KeyRole role, std::string_view action, Callers callers) {
  std::string needed = "the full key";
  if (callers == Callers::kWorkers) needed = "a worker's key or the full key";
  if (callers == Callers::kClients) needed = "a client's key or the full key";
  return "a " + std::string(ToString(role)) + "'s key does not permit " + std::string(action) + "; give --key-file " +
         needed;
}

namespace {

constexpr std::size_t kDigits = 2 * MessageKey::kBytes;
constexpr std::size_t kMostFileBytes = sizeof "worker" + kDigits + 2;  // role and blank, digits, CR, LF

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

// Buffer for a secret text; cleared by the destructor.
struct SecretText {
  std::array<char, kMostFileBytes + 1> bytes{};
  ~SecretText() { sodium_memzero(bytes.data(), bytes.size()); }
};

// Returns whether the file is a systemd credential (LoadCredential=). systemd copies the credentials of a unit to a
// folder owned by root, as files of mode 0440. The group bits are the mask of the access control list that grants
// access to the unit's user; other users cannot enter the folder.
bool IsCredential(const std::string& file, const struct stat& status) {
  const char* folder = std::getenv("CREDENTIALS_DIRECTORY");
  if (folder == nullptr || *folder != '/') return false;
  std::string prefix(folder);
  while (prefix.ends_with('/')) prefix.pop_back();
  prefix += '/';
  if (!file.starts_with(prefix) || file.find('/', prefix.size()) != std::string::npos) return false;
  struct stat place {};
  if (::stat(folder, &place) != 0 || (place.st_mode & S_IRWXO) != 0) return false;
  if (place.st_uid != 0 && place.st_uid != ::geteuid()) return false;
  return (status.st_mode & (S_IWGRP | S_IXGRP | S_IRWXO)) == 0;
}

// Returns the number in "/dev/fd/N" and "/proc/self/fd/N"; -1 for other names.
int DescriptorNamed(const std::string& file) {
  for (const std::string_view folder : {"/dev/fd/", "/proc/self/fd/"}) {
    if (!file.starts_with(folder)) continue;
    int number = -1;
    const char* const end = file.data() + file.size();
    const auto [rest, error] = std::from_chars(file.data() + folder.size(), end, number);
    if (error == std::errc{} && rest == end && number >= 0) return number;
  }
  return -1;
}

// Opens a key file for reading. An inherited descriptor may refer to a file without a name; child processes must not
// inherit it.
int OpenForReading(const std::string& file) {
  const int given = DescriptorNamed(file);
  if (given < 0) return ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);  // a pipe must not block
  const int copy = ::fcntl(given, F_DUPFD_CLOEXEC, 0);
  if (copy >= 0) ::fcntl(given, F_SETFD, FD_CLOEXEC);
  return copy;
}

void CheckWhoMayRead(const std::string& file, int fd) {
  struct stat status {};
  if (::fstat(fd, &status) != 0) Refuse(file, "cannot be examined: " + Reason());
  if (!S_ISREG(status.st_mode)) Refuse(file, "is not a regular file");
  if (status.st_uid != ::geteuid() && status.st_uid != 0) {
    Refuse(file, "belongs to user " + std::to_string(status.st_uid) + "; it must be yours: chown it");
  }
  if ((status.st_mode & (S_IRWXG | S_IRWXO)) != 0 && !IsCredential(file, status)) {
    Refuse(file, "is open to others; only its owner may read it: chmod 600 '" + file + "'");
  }
}

std::size_t ReadAll(const std::string& file, int fd, std::span<char> text) {
  std::size_t size = 0;
  while (size < text.size()) {
    const ssize_t got = ::pread(fd, text.data() + size, text.size() - size, static_cast<off_t>(size));
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
    if (put <= 0) Refuse(file, "cannot be written: " + files::Explain(errno));
    text = text.subspan(static_cast<std::size_t>(put));
  }
}

// Role named in a key file, and the digits.
struct KeyText {
  KeyRole role = KeyRole::kOperator;
  std::string_view digits;
};

KeyText SplitRole(std::string_view text) {
  for (const KeyRole role : kDerivedRoles) {
    const std::string_view word = ToString(role);
    if (text.starts_with(word) && text.substr(word.size()).starts_with(' '))
      return {role, text.substr(word.size() + 1)};
  }
  return {KeyRole::kOperator, text};
}

using Bytes = std::array<std::uint8_t, MessageKey::kBytes>;

// Frames have tags of 16 bytes, which BLAKE2b computes with other parameters. Tags therefore reveal nothing about
// derived keys.
Bytes DeriveKey(std::span<const std::uint8_t> full, KeyRole role) {
  const std::string message = "legopt " + std::string(ToString(role));
  Bytes derived{};
  crypto_generichash(derived.data(), derived.size(), reinterpret_cast<const std::uint8_t*>(message.data()),
                     message.size(), full.data(), full.size());
  return derived;
}

}  // namespace

MessageKey::MessageKey(std::span<const std::uint8_t, kBytes> bytes, KeyRole role) : role_(role) {
  std::copy(bytes.begin(), bytes.end(), bytes_.begin());
  if (role != KeyRole::kOperator) return;
  PrepareHashing();
  for (std::size_t i = 0; i < kDerivedRoles.size(); ++i) {
    Bytes derived = DeriveKey(bytes_, kDerivedRoles[i]);
    derived_[i] = std::make_unique<const MessageKey>(derived, kDerivedRoles[i]);
    sodium_memzero(derived.data(), derived.size());
  }
}

MessageKey::~MessageKey() { sodium_memzero(bytes_.data(), bytes_.size()); }

std::shared_ptr<const MessageKey> MessageKey::Load(const std::string& file) {
  PrepareHashing();
  const Descriptor fd(OpenForReading(file));
  if (fd.get() < 0 && errno == EACCES) {
    Refuse(file, "cannot be opened: this program runs as user " + std::to_string(::geteuid()) +
                     ", who may not read it; give that user a copy of its own with mode 600, or a systemd unit "
                     "LoadCredential=key:FILE and --key-file ${CREDENTIALS_DIRECTORY}/key");
  }
  if (fd.get() < 0 && files::IsShortage(errno)) throw std::system_error(errno, std::generic_category(), file);
  if (fd.get() < 0) Refuse(file, "cannot be opened: " + Reason() + "; make one: legopt service keygen FILE");
  CheckWhoMayRead(file, fd.get());
  SecretText text;
  const std::size_t size = WithoutLineEnd({text.bytes.data(), ReadAll(file, fd.get(), text.bytes)});
  const KeyText parts = SplitRole({text.bytes.data(), size});
  Bytes bytes{};
  std::size_t decoded = 0;
  const bool legal =
      parts.digits.size() == kDigits && sodium_hex2bin(bytes.data(), bytes.size(), parts.digits.data(),
                                                       parts.digits.size(), nullptr, &decoded, nullptr) == 0;
  if (!legal || decoded != kBytes) {
    Refuse(file,
           "must hold exactly 64 hexadecimal digits and a line end, after \"worker \" or \"client \" for the key of "
           "a role; make one: legopt service keygen FILE");
  }
  auto key = std::make_shared<const MessageKey>(std::span<const std::uint8_t, kBytes>(bytes), parts.role);
  sodium_memzero(bytes.data(), bytes.size());
  return key;
}

std::shared_ptr<const MessageKey> MessageKey::Random() {
  PrepareHashing();
  Bytes bytes{};
  randombytes_buf(bytes.data(), bytes.size());
  auto key = std::make_shared<const MessageKey>(bytes);
  sodium_memzero(bytes.data(), bytes.size());
  return key;
}

const MessageKey* MessageKey::ForRole(KeyRole role) const {
  if (role == role_) return this;
  for (const auto& derived : derived_) {
    if (derived != nullptr && derived->role() == role) return derived.get();
  }
  return nullptr;
}

std::string MessageKey::FileText() const {
  SecretText digits;
  sodium_bin2hex(digits.bytes.data(), digits.bytes.size(), bytes_.data(), bytes_.size());
  const std::string role = role_ == KeyRole::kOperator ? std::string() : std::string(ToString(role_)) + ' ';
  return role + std::string(digits.bytes.data(), kDigits) + '\n';
}

void MessageKey::WriteFile(const std::string& file) const {
  try {
    files::CreateFile(file, FileText(), {files::kReadableByOwner, files::Durability::kSynced});
  } catch (const files::FileError& error) {
    if (error.shortage()) throw;
    Refuse(file, error.reason());
  }
}

int MessageKey::WriteInMemory() const {
  constexpr int kLowest = 3;  // not a standard stream of a child
  const Descriptor memory(::memfd_create("legopt-key", MFD_CLOEXEC));
  const int fd = memory.get() < 0 ? -1 : ::fcntl(memory.get(), F_DUPFD_CLOEXEC, kLowest);
  if (fd < 0 || ::fchmod(fd, S_IRUSR | S_IWUSR) != 0) {
    throw std::system_error(errno, std::generic_category(), "a key in memory");
  }
  WriteAll("/dev/fd/" + std::to_string(fd), fd, FileText());
  return fd;
}

Tag ComputeTag(std::span<const std::uint8_t> datagram, std::size_t offset, const MessageKey* key) {
  constexpr Tag kZeros{};
  crypto_generichash_state state;
  Tag tag;
  if (key == nullptr) {
    crypto_generichash_init(&state, nullptr, 0, tag.size());
  } else {
    crypto_generichash_init(&state, key->bytes().data(), key->bytes().size(), tag.size());
  }
  crypto_generichash_update(&state, datagram.data(), offset);
  crypto_generichash_update(&state, kZeros.data(), kZeros.size());
  const auto rest = datagram.subspan(offset + kTagBytes);
  crypto_generichash_update(&state, rest.data(), rest.size());
  crypto_generichash_final(&state, tag.data(), tag.size());
  return tag;
}

// Takes constant time: a forger must not learn how many bytes were correct.
bool TagIsRight(std::span<const std::uint8_t> datagram, std::size_t offset, const MessageKey* key) {
  const Tag right = ComputeTag(datagram, offset, key);
  return sodium_memcmp(right.data(), datagram.subspan(offset).data(), right.size()) == 0;
}

const MessageKey* KeyOfRole(const MessageKey* key, KeyRole role) {
  if (key == nullptr) return nullptr;
  const MessageKey* of_role = key->ForRole(role);
  if (of_role == nullptr) {
    std::fprintf(stderr, "legopt bus: broken invariant: no tag of a %s from the key of a %s\n",
                 std::string(ToString(role)).c_str(), std::string(ToString(key->role())).c_str());
    std::abort();
  }
  return of_role;
}

std::optional<KeyRole> RoleOfTag(std::span<const std::uint8_t> datagram, std::size_t offset, const MessageKey* key) {
  if (key == nullptr) return TagIsRight(datagram, offset, nullptr) ? std::optional(KeyRole::kOperator) : std::nullopt;
  if (TagIsRight(datagram, offset, key)) return key->role();
  for (const KeyRole role : kDerivedRoles) {
    const MessageKey* derived = key->ForRole(role);
    if (derived != nullptr && derived != key && TagIsRight(datagram, offset, derived)) return role;
  }
  return std::nullopt;
}

}  // namespace legopt::bus
