#include "bus/tag.h"

#include <sodium.h>

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

// In constant time: a forger must not learn how many bytes were right.
bool TagIsRight(std::span<const std::uint8_t> datagram, std::size_t offset, const MessageKey* key) {
  const Tag right = ComputeTag(datagram, offset, key);
  return sodium_memcmp(right.data(), datagram.subspan(offset).data(), right.size()) == 0;
}

}  // namespace legopt::bus
