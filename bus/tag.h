#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "bus/message_key.h"

/// @file
/// The tag by which a datagram proves that it is whole and, under a key, who may have made it: BLAKE2b-128 of all its
/// bytes with zeros in place of the tag (PROTOCOL.md, section 3). For bus and bridge. After PrepareHashing() of wire.h.

namespace legopt::bus {

inline constexpr std::size_t kTagBytes = 16;  ///< of every tag
/// As it stands in a datagram.
using Tag = std::array<std::uint8_t, kTagBytes>;

/// Of a datagram whose tag stands at `offset`; keyed if there is a key.
Tag ComputeTag(std::span<const std::uint8_t> datagram, std::size_t offset, const MessageKey* key);

/// The key with which a party that has `key` makes tags for a role; null without a key. Aborts when the role's key does
/// not follow from `key`.
const MessageKey* KeyOfRole(const MessageKey* key, KeyRole role);

/// Role of the key that the tag at `offset` is made with: `key` or one derived from it; kOperator for a right tag where
/// there is no key. Empty: the tag is wrong. In constant time for each key.
std::optional<KeyRole> RoleOfTag(std::span<const std::uint8_t> datagram, std::size_t offset, const MessageKey* key);

/// Whether the tag that stands at `offset` is the right one. In constant time.
bool TagIsRight(std::span<const std::uint8_t> datagram, std::size_t offset, const MessageKey* key);

}  // namespace legopt::bus
