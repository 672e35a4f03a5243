#include "legopt/math/blake2b.h"

#include <sodium.h>

#include <vector>

#include "legopt/types/invariant.h"

namespace legopt {

std::string Blake2bHex(std::string_view bytes, std::size_t hash_bytes) {
  CheckInvariant(hash_bytes >= crypto_generichash_BYTES_MIN && hash_bytes <= crypto_generichash_BYTES_MAX,
                 "a BLAKE2b hash has 16 to 64 bytes", hash_bytes);
  std::vector<unsigned char> hash(hash_bytes);
  crypto_generichash(hash.data(), hash.size(), reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(),
                     nullptr, 0);
  return HexText(hash);
}

std::string HexText(std::span<const unsigned char> bytes) {
  std::string text(2 * bytes.size() + 1, '\0');
  sodium_bin2hex(text.data(), text.size(), bytes.data(), bytes.size());
  text.pop_back();
  return text;
}

bool IsBlake2bHex(std::string_view text) {
  return text.size() == std::size_t{2} * crypto_generichash_BYTES &&
         text.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

}  // namespace legopt
