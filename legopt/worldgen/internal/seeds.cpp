#include "legopt/worldgen/internal/seeds.h"

#include "legopt/math/blake2b.h"
#include "legopt/types/number_text.h"

namespace legopt::worldgen {

std::uint64_t DeriveSeed(std::uint64_t seed, const std::string& purpose) {
  constexpr std::size_t kDigits = 16;
  constexpr int kHexadecimal = 16;
  return *ParseInteger<std::uint64_t>(Blake2bHex(std::to_string(seed) + "/" + purpose).substr(0, kDigits),
                                      kHexadecimal);
}

}  // namespace legopt::worldgen
