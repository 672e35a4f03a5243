#pragma once

#include <cstdint>

#include "words/words.h"

namespace legopt {

/// What a job that is solved again gives, beside its stored result.
enum class Reproduction : std::uint8_t {
  kBitIdentical,  ///< the same solution, counts, costs and verdicts, bit by bit
  kSameStatus,    ///< the same status and verdicts, but not the same bits
  kDiffers,       ///< another status or verdict, or none
};

template <>
inline constexpr auto kWords<Reproduction> = Words<Reproduction>({{Reproduction::kBitIdentical, "bit-identical"},
                                                                  {Reproduction::kSameStatus, "same status"},
                                                                  {Reproduction::kDiffers, "differs"}});

}  // namespace legopt
