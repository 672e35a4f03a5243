#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

/// @file
/// The shared secret of a deployment: with it every datagram carries a keyed tag (PROTOCOL.md, section 11).
///
/// A key file holds 64 hexadecimal digits and at most one line end, belongs to the user (or root) and is readable by
/// no other user. In systemd's folder of credentials ($CREDENTIALS_DIRECTORY) mode 0440 is legal: systemd grants access
/// there by an access control list. "/dev/fd/N" names descriptor N of this process, which may lead to a file
/// without a name. Thread rule: immutable after construction.

namespace legopt::bus {

/// A key in memory, where nothing else copies it to.
class MessageKey {
 public:
  /// Length of a key.
  static constexpr std::size_t kBytes = 32;

  /// Copies the bytes.
  explicit MessageKey(std::span<const std::uint8_t, kBytes> bytes);
  ~MessageKey();  ///< leaves no copy in memory
  MessageKey(const MessageKey&) = delete;
  MessageKey& operator=(const MessageKey&) = delete;

  /// Throws BusError (kInvalidOption) naming the file, the fault and the command that repairs it: not a regular file,
  /// owned by another user, open to group or others, not 64 hexadecimal digits. Programs that are started later do not
  /// inherit a descriptor that was loaded.
  static std::shared_ptr<const MessageKey> Load(const std::string& file);
  /// Descriptor of a new key file that has no name and exists in memory only, with a fresh random key. The descriptor
  /// is at least 3, close-on-exec, and to be closed by the caller. Throws std::system_error.
  static int CreateInMemory();
  /// Writes a fresh random key to a new file of mode 0600, synced. Throws BusError (kInvalidOption) when it exists or
  /// cannot be written.
  static void CreateFile(const std::string& file);

  std::span<const std::uint8_t, kBytes> bytes() const { return bytes_; }  ///< for the tag; valid as long as the key

 private:
  std::array<std::uint8_t, kBytes> bytes_{};
};

}  // namespace legopt::bus
