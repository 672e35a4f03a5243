#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "bus/key_role.h"

/// @file
/// Shared secret of a deployment, which authenticates every datagram by a keyed tag (PROTOCOL.md, section 11).
///
/// Operators and the server have the full key. The keys of workers and clients are derived from it. A derived key
/// reveals neither the full key nor the other derived key.
///
/// A key file contains 64 hexadecimal digits and at most one line end. The file of a derived key has "worker " or
/// "client " before the digits. The file belongs to the user (or root), and no other user can read it. In systemd's
/// folder of credentials ($CREDENTIALS_DIRECTORY) mode 0440 is allowed: systemd grants access there by an access
/// control list. "/dev/fd/N" names descriptor N of this process, which may refer to a file without a name. Thread rule:
/// immutable after construction.

namespace legopt::bus {

/// Key in memory. Its destructor clears it.
class MessageKey {
 public:
  /// Length of a key in bytes.
  static constexpr std::size_t kBytes = 32;

  /// Copies the bytes. With kOperator they are a full key, from which the keys of the other roles are derived.
  explicit MessageKey(std::span<const std::uint8_t, kBytes> bytes, KeyRole role = KeyRole::kOperator);
  ~MessageKey();
  MessageKey(const MessageKey&) = delete;
  MessageKey& operator=(const MessageKey&) = delete;

  /// Reads a key file. Throws BusError (kInvalidOption) with the file, the fault and the command that repairs it: not a
  /// regular file, owned by another user, accessible to group or others, not 64 hexadecimal digits. A descriptor that
  /// was read is not inherited by programs started later.
  static std::shared_ptr<const MessageKey> Load(const std::string& file);
  /// Returns a new random full key.
  static std::shared_ptr<const MessageKey> Random();

  /// Writes the key to a new file without a name that exists only in memory. Returns its descriptor, which is at least
  /// 3 and close-on-exec; the caller closes it. Throws std::system_error.
  int WriteInMemory() const;
  /// Writes a new key file with mode 0600 and syncs it. Throws BusError (kInvalidOption) if it exists or cannot be
  /// written.
  void WriteFile(const std::string& file) const;
  /// Content of the key file. Secret.
  std::string FileText() const;

  /// Returns the key of a role: a full key has those of all roles, a derived key only its own; otherwise null. The
  /// result is valid as long as this key.
  const MessageKey* ForRole(KeyRole role) const;
  KeyRole role() const { return role_; }
  std::span<const std::uint8_t, kBytes> bytes() const { return bytes_; }  ///< valid as long as the key

 private:
  std::array<std::uint8_t, kBytes> bytes_{};
  KeyRole role_;
  std::array<std::unique_ptr<const MessageKey>, kDerivedRoles.size()> derived_;  // empty for a derived key
};

}  // namespace legopt::bus
