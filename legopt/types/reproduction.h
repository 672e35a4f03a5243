#pragma once

#include <cstdint>

#include "legopt/types/enum_names.h"

namespace legopt {

/// Result of re-running a job, compared with its stored result.
enum class Reproduction : std::uint8_t {
  kBitIdentical,  ///< same solution, counts, costs and verdicts, bit by bit
  kSameStatus,    ///< same status and verdicts, but different bits
  kDiffers,       ///< another status or verdict, or no result
};

template <>
inline constexpr auto kEnumNames<Reproduction> =
    MakeEnumNames<Reproduction>({{Reproduction::kBitIdentical, "bit-identical"},
                                 {Reproduction::kSameStatus, "same status"},
                                 {Reproduction::kDiffers, "differs"}});

}  // namespace legopt
