#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "client/compare/solves.h"
#include "legopt/types/task.h"

namespace legopt::client {

/// The factor of PAR10: a failed run is charged this multiple of the limit.
inline constexpr double kPenaltyFactor = 10.0;

/// Time limit per waypoint used for the charge if the solver is limited by effort instead of wall time. It does not
/// depend on the shown methods, so figures do not change when a method is added.
inline constexpr double kLimitPerWaypoint_ms = 1000.0;

/// Source of a charge.
enum class ChargeRule : std::uint8_t {
  kChosen,       ///< set by --charge
  kPerWaypoint,  ///< ten times kLimitPerWaypoint_ms for each waypoint of the problem
  kWallLimit     ///< ten times the wall-time limit, if it is the only limit
};

/// Time charged for a failed run in mean times.
struct Charge {
  double ms = 0.0;  ///< milliseconds per run; per waypoint with kPerWaypoint
  ChargeRule rule = ChargeRule::kWallLimit;

  /// Returns the mean time of a problem's finished runs, with failed runs at the charge.
  double Apply(const ProblemRuns& problem) const;
};

/// Returns the charge of each task for cells that are shown or compared together. `chosen_ms` (> 0) is used unchanged.
/// With kWallLimit the smallest limit is used. 0 for tasks without cells.
EnumArray<Task, Charge> ChargesOf(std::span<const SolveCell> cells, std::optional<double> chosen_ms);

/// Returns e.g. "10.0 s for each waypoint of the problem", "3.00 s, as chosen" for captions, in `unit`.
std::string DescribeCharge(const Charge& charge, const TimeUnit& unit);

/// Returns "chosen", "per_waypoint" or "wall_limit".
const char* EnumNameOf(ChargeRule rule);

/// Returns "PAR10", or "Charged" if the charge was chosen.
const char* TitleOfChargedMean(ChargeRule rule);

}  // namespace legopt::client
