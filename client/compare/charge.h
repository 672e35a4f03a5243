#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "client/compare/solves.h"
#include "words/task.h"

namespace legopt::client {

/// The factor of PAR10: a failed run is charged so many limits.
inline constexpr double kPenaltyFactor = 10.0;

/// The limit of time of a problem for each of its waypoints where the solver is limited by effort, not by the clock. It
/// depends on nothing that is shown or compared, so that a figure does not change when a method is added.
inline constexpr double kLimitPerWaypoint_ms = 1000.0;

/// Where a charge comes from.
enum class ChargeRule : std::uint8_t {
  kChosen,       ///< --charge
  kPerWaypoint,  ///< ten times kLimitPerWaypoint_ms for each waypoint of the problem
  kWallLimit     ///< ten times the limit of wall time, where it is the only limit
};

/// What a failed run costs in means of times.
struct Charge {
  double ms = 0.0;  ///< milliseconds for a run; with kPerWaypoint for each waypoint
  ChargeRule rule = ChargeRule::kWallLimit;

  /// The mean time of a problem's finished runs, each failed one at the charge.
  double Apply(const ProblemRuns& problem) const;
};

/// The charge of each task for cells that are shown or compared together. `chosen_ms` (> 0) is taken as it is. With
/// kWallLimit the smallest limit counts. 0 for tasks without cells.
Per<Task, Charge> ChargesOf(std::span<const SolveCell> cells, std::optional<double> chosen_ms);

/// "10.0 s for each waypoint of the problem", "3.00 s, as chosen": for captions, in `unit`.
std::string DescribeCharge(const Charge& charge, const TimeUnit& unit);

/// "chosen", "per_waypoint", "wall_limit"
const char* WordOf(ChargeRule rule);

/// "PAR10", or "Charged" where the charge was chosen.
const char* TitleOfChargedMean(ChargeRule rule);

}  // namespace legopt::client
