#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "bus/key_role.h"

/// @file
/// The shared secret of a deployment: with it every datagram carries a keyed tag (PROTOCOL.md, section 11).
///
/// The full key is that of operators and of the server. A worker's and a client's key are derived from it; neither the
/// full key nor the other derived key follows from one of them.
///
/// A key file holds 64 hexadecimal digits, after "worker " or "client " in the file of a derived key, and at most one
/// line end. It belongs to the user (or root) and is readable by
/// no other user. In systemd's folder of credentials ($CREDENTIALS_DIRECTORY) mode 0440 is legal: systemd grants access
/// there by an access control list. "/dev/fd/N" names descriptor N of this process, which may lead to a file
/// without a name. Thread rule: immutable after construction.

namespace legopt::bus {

/// A key in memory, where nothing else copies it to.
class MessageKey {
 public:
  /// Length of a key.
  static constexpr std::size_t kBytes = 32;

  /// Copies the bytes. With kOperator they are a full key, and the keys of the other roles are derived from it.
  explicit MessageKey(std::span<const std::uint8_t, kBytes> bytes, KeyRole role = KeyRole::kOperator);
  ~MessageKey();  ///< leaves no copy in memory
  MessageKey(const MessageKey&) = delete;
  MessageKey& operator=(const MessageKey&) = delete;

  /// Throws BusError (kInvalidOption) naming the file, the fault and the command that repairs it: not a regular file,
  /// owned by another user, open to group or others, not 64 hexadecimal digits. Programs that are started later do not
  /// inherit a descriptor that was loaded.
  static std::shared_ptr<const MessageKey> Load(const std::string& file);
  /// A fresh random full key.
  static std::shared_ptr<const MessageKey> Random();

  /// Descriptor of a new key file that has no name and exists in memory only. The descriptor is at least 3,
  /// close-on-exec, and to be closed by the caller. Throws std::system_error.
  int WriteInMemory() const;
  /// Writes a new key file of mode 0600, synced. Throws BusError (kInvalidOption) when it exists or cannot be written.
  void WriteFile(const std::string& file) const;
  /// Content of the key file. A secret.
  std::string FileText() const;

  /// The key of a role, valid as long as this one: of a full key every role's, of a derived key its own; else null.
  const MessageKey* ForRole(KeyRole role) const;
  KeyRole role() const { return role_; }                                  ///< role of the holder
  std::span<const std::uint8_t, kBytes> bytes() const { return bytes_; }  ///< for the tag; valid as long as the key

 private:
  std::array<std::uint8_t, kBytes> bytes_{};
  KeyRole role_;
  std::array<std::unique_ptr<const MessageKey>, kDerivedRoles.size()> derived_;  // empty for a derived key
};

}  // namespace legopt::bus
