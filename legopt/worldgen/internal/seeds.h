#pragma once

#include <cstdint>
#include <string>

namespace legopt::worldgen {

/// Derives an independent seed for a purpose: 64 bits of BLAKE2b of "seed/purpose".
std::uint64_t DeriveSeed(std::uint64_t seed, const std::string& purpose);

}  // namespace legopt::worldgen
