#include "bus/tag.h"

#include <sodium.h>

#include <cstdio>
#include <cstdlib>
#include <string>

namespace legopt::bus {

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
