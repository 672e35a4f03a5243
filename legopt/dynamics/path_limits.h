#pragma once

#include <span>
#include <vector>

#include "legopt/dynamics/phase_set.h"

namespace legopt {

/// Where no time law passes a path, and why.
struct TimeBlock {
  int point = -1;     ///< index in the grid; -1: the path can be passed
  int interval = -1;  ///< interval with these contacts; -1: contacts at rest, at the first or last point
  LimitOwner owner;
};

/// What limits the speed on a path with the grid s_0 .. s_N. Contacts can change at a point of the grid, so that the
/// admissible pairs (u, x) differ before and after it.
struct PathLimits {
  std::vector<double> grid;  ///< increasing, N + 1
  /// Pairs (u_k, x_k) of each interval k with (u_k, x_k) admissible at its begin and (u_k, x_k + 2 D_k u_k) at its end,
  /// with D_k = s_k+1 - s_k; N. u is constant within an interval.
  std::vector<PhaseSet> intervals;
  PhaseSet start, end;  ///< admissible pairs at the first and last point, where the robot rests
  TimeBlock empty;      ///< the first point with no admissible pair
};

/// Joins the sets of the points. `begins`, `ends`: one per interval, at its ends and with its contacts.
PathLimits JoinSets(std::vector<double> grid, std::span<const PhaseSet> begins, std::span<const PhaseSet> ends,
                    PhaseSet start, PhaseSet end);

/// Joins the sets of a path whose contacts do not change. `sets`: one per point.
PathLimits JoinSets(std::vector<double> grid, std::span<const PhaseSet> sets);

}  // namespace legopt
