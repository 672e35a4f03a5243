#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "bus/messages.h"
#include "legopt/types/enum_names.h"

namespace legopt::bus {

/// @file
/// Roles of keys, and the calls that each role permits. PROTOCOL.md, section 11. Thread rule: none, types and
/// constants.

/// Role of the key that made a tag. Without a key every party is an operator.
enum class KeyRole : std::uint8_t {
  kOperator,  ///< full key: every call
  kWorker,    ///< key derived for workers
  kClient,    ///< key derived for clients
};
/// Roles whose keys are derived from the full key.
inline constexpr std::array<KeyRole, 2> kDerivedRoles = {KeyRole::kWorker, KeyRole::kClient};

}  // namespace legopt::bus

/// Names in key files and on command lines.
template <>
inline constexpr auto legopt::kEnumNames<legopt::bus::KeyRole> =
    legopt::MakeEnumNames<legopt::bus::KeyRole>({{legopt::bus::KeyRole::kOperator, "operator"},
                                                 {legopt::bus::KeyRole::kWorker, "worker"},
                                                 {legopt::bus::KeyRole::kClient, "client"}});

namespace legopt::bus {

/// Returns "operator", "worker" or "client".
constexpr std::string_view ToString(KeyRole role) { return legopt::ToString(role); }

/// Roles that may make a call besides operators: the last column of lcmtypes/messages.def.
enum class Callers : std::uint8_t {
  kAnyone,    ///< workers and clients
  kWorkers,   ///< workers only
  kClients,   ///< clients only
  kOperator,  ///< operators only
};

/// Returns the callers of a message type; kOperator for an unknown number.
constexpr Callers CallersOf(MessageType type) {
  switch (type) {
#define LEGOPT_PART(name)
#define LEGOPT_CALL(number, Name, name, callers) \
  case MessageType::k##Name:                     \
    return Callers::k##callers;
#include "lcmtypes/messages.def"
  }
  return Callers::kOperator;
}

/// Returns whether a role's key permits a call. For control calls of clients the server additionally checks the action
/// (server/permission.h).
constexpr bool MayCall(KeyRole role, MessageType type) {
  const Callers callers = CallersOf(type);
  switch (role) {
    case KeyRole::kOperator:
      return true;
    case KeyRole::kWorker:
      return callers == Callers::kAnyone || callers == Callers::kWorkers;
    case KeyRole::kClient:
      return callers == Callers::kAnyone || callers == Callers::kClients;
  }
  return false;
}

/// Returns the message for a refused call or action, which names the action and the required key. `action` is a noun
/// such as "submit" or "delete of an experiment"; `callers` are the permitted roles.
std::string RoleRefusal(KeyRole role, std::string_view action, Callers callers);

// Shared secret of a deployment, which authenticates every datagram by a keyed tag (PROTOCOL.md, section 11).
//
// Operators and the server have the full key. The keys of workers and clients are derived from it. A derived key
// reveals neither the full key nor the other derived key.
//
// A key file contains 64 hexadecimal digits and at most one line end. The file of a derived key has "worker " or
// "client " before the digits. The file belongs to the user (or root), and no other user can read it. In systemd's
// folder of credentials ($CREDENTIALS_DIRECTORY) mode 0440 is allowed: systemd grants access there by an access
// control list. "/dev/fd/N" names descriptor N of this process, which may refer to a file without a name. Thread rule:
// immutable after construction.

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

// Tag of a datagram, which proves its integrity and, with a key, the role of its sender: BLAKE2b-128 of all its bytes
// with zeros in place of the tag (PROTOCOL.md, section 3). Used by bus and bridge. Call PrepareHashing() of wire.h
// first.

inline constexpr std::size_t kTagBytes = 16;  ///< length of every tag
/// Tag as stored in a datagram.
using Tag = std::array<std::uint8_t, kTagBytes>;

/// Returns the tag of a datagram, which stores it at `offset`; keyed if there is a key.
Tag ComputeTag(std::span<const std::uint8_t> datagram, std::size_t offset, const MessageKey* key);

/// Returns the key with which the holder of `key` makes tags for a role; null without a key. Aborts if the role's key
/// cannot be derived from `key`.
const MessageKey* KeyOfRole(const MessageKey* key, KeyRole role);

/// Returns the role of the key that made the tag at `offset`: `key` or one derived from it. Returns kOperator for a
/// valid tag without a key, and nothing for a wrong tag. Takes constant time for each key.
std::optional<KeyRole> RoleOfTag(std::span<const std::uint8_t> datagram, std::size_t offset, const MessageKey* key);

/// Returns whether the tag at `offset` is valid. Takes constant time.
bool TagIsRight(std::span<const std::uint8_t> datagram, std::size_t offset, const MessageKey* key);

}  // namespace legopt::bus
