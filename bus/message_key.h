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
/// nobody else. Thread rule: immutable after construction.

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
  /// owned by another user, open to group or others, not 64 hexadecimal digits.
  static std::shared_ptr<const MessageKey> Load(const std::string& file);
  /// Writes a fresh random key to a new file of mode 0600, synced. Throws BusError (kInvalidOption) when it exists or
  /// cannot be written.
  static void CreateFile(const std::string& file);

  std::span<const std::uint8_t, kBytes> bytes() const { return bytes_; }  ///< for the tag; valid as long as the key

 private:
  std::array<std::uint8_t, kBytes> bytes_{};
};

}  // namespace legopt::bus
