#pragma once

#include <cstdint>
#include <string>

namespace legopt::generate {

/// A seed of its own for every purpose: 64 bits of BLAKE2b of "seed/purpose".
std::uint64_t DeriveSeed(std::uint64_t seed, const std::string& purpose);

}  // namespace legopt::generate
