#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "client/compare/solves.h"
#include "words/task.h"

namespace legopt::client {

/// What a charge is made of, where nobody has chosen one, as a factor: PAR10.
inline constexpr double kPenaltyFactor = 10.0;

/// Where a charge comes from.
enum class ChargeRule : std::uint8_t {
  kChosen,         ///< somebody said so (--charge)
  kLongestSolved,  ///< ten times the longest time of a solved run: limits of effort end solves, the clock none
  kWallLimit,      ///< ten times the limit of wall time, where it is the only limit, or where nothing was solved
};

/// What a failed run costs in means of times.
struct Charge {
  double ms = 0.0;
  ChargeRule rule = ChargeRule::kWallLimit;
};

/// The charge of each task over all cells that are shown or compared together, their starts alike, so that they mean
/// the same everywhere. `chosen_ms` (> 0) is taken as it is. The smallest wall limit counts. 0 for tasks without cells.
Per<Task, Charge> ChargesOf(std::span<const SolveCell> cells, std::optional<double> chosen_ms);

/// "12.3 s, ten times the longest solved run of posture": for captions, in `unit`.
std::string DescribeCharge(const Charge& charge, Task task, const TimeUnit& unit);

/// "chosen", "longest_solved", "wall_limit"
const char* WordOf(ChargeRule rule);

/// "PAR10", or "Charged" where the charge was chosen.
const char* TitleOfChargedMean(ChargeRule rule);

}  // namespace legopt::client
