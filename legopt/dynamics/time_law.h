#pragma once

#include <span>
#include <vector>

#include "legopt/dynamics/path_limits.h"

namespace legopt {

/// How a path is traversed from rest to rest.
struct TimeLaw {
  bool exists = false;
  bool optimal = false;  ///< the duration is the least one; else an upper bound
  TimeBlock blocked;     ///< without a time law: the first point with an empty set, or else one that cannot be passed
  double duration_s = 0.0;         ///< infinite if there is none
  std::vector<double> x;           ///< (ds/dt)^2 at each point; empty if there is none
  std::vector<LimitOwner> limits;  ///< per interval: the limit with the least slack
};

/// Intervals [lowest, highest] of x at each point from which the rest of the path can be traversed and ends at rest.
struct ControllableSets {
  std::vector<double> lowest, highest;  ///< lowest > highest: empty
  int blocked = -1;                     ///< last point with an empty interval when counting from the end; -1: none
};

/// Computes them from the last point backwards: K_N = {0}, K_k = {x : (u, x) in C_k, x + 2 D_k u in K_k+1}, with the
/// sets C_k of the intervals. At the last point the robot must be able to rest.
///
/// Source: Pham, Pham, A New Approach to Time-Optimal Path Parameterization Based on Reachability Analysis, T-RO 2018.
ControllableSets ComputeControllableSets(const PathLimits& path);

/// Returns the duration of a time law with (ds/dt)^2 piecewise linear in s: sum 2 D_k / (sqrt x_k + sqrt x_k+1), s.
double Duration_s(std::span<const double> grid, std::span<const double> x);

/// Computes the greedy time law of TOPP-RA: from the first point on, the largest admissible acceleration that stays in
/// the controllable sets. An upper bound of the shortest duration; greedy choices are not optimal where contacts limit
/// the speed at isolated points.
TimeLaw ComputeGreedyTimeLaw(const PathLimits& path);

/// Computes the shortest time law, from rest to rest; the robot must be able to stand still at both ends:
///
///     T* = min sum_k 2 D_k / (sqrt x_k + sqrt x_k+1)   s.t.  (u_k, x_k) in C_k,  u_k = (x_k+1 - x_k) / 2 D_k
///
/// a convex program with constraints between neighbours only, by a primal-dual interior-point method with tridiagonal
/// Newton systems. The greedy law decides whether there is one, and is returned if the search does not improve on it.
///
/// Source: Verscheure et al., Time-Optimal Path Tracking for Robots: A Convex Optimization Approach, IEEE TAC 2009.
TimeLaw ComputeTimeLaw(const PathLimits& path);

/// Returns the duration with constant ds/dt, without start and stop; infinite if there is none.
double UniformDuration_s(const PathLimits& path);

}  // namespace legopt
