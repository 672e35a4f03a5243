#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "bus/message_key.h"

/// @file
/// Tag of a datagram, which proves its integrity and, with a key, the role of its sender: BLAKE2b-128 of all its bytes
/// with zeros in place of the tag (PROTOCOL.md, section 3). Used by bus and bridge. Call PrepareHashing() of wire.h
/// first.

namespace legopt::bus {

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
