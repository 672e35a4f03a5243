#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/problem_definition.h"
#include "legopt/dynamics/path_spline.h"
#include "legopt/dynamics/phase_set.h"
#include "legopt/dynamics/time_law.h"

namespace legopt {

/// Shares of a duration by the nearest limit.
struct LimitShares {
  double velocity = 0.0, torque = 0.0, contact = 0.0;
};

/// How fast a motion can be executed.
struct MotionTiming {
  double shortest_s = 0.0;   ///< T*, from rest to rest; infinite if no time law exists, 0 for a motion at rest
  double greedy_s = 0.0;     ///< duration of TOPP-RA's greedy pass
  double uniform_s = 0.0;    ///< duration at constant ds/dt, without start and stop
  double reduced_s = 0.0;    ///< T* with friction and effort limits reduced to kReducedShare
  double grid_change = 0.0;  ///< change of T* by the last refinement of the grid, as a share
  int grid_points = 0;
  LimitShares limits;              ///< shares of T*
  bool optimal = true;             ///< T* is the optimum; else an upper bound
  double blocked_at = -1.0;        ///< without a time law: parameter of the first point with no admissible pair, or
                                   ///< parameter of a point that cannot be passed
  std::string blocked_by;          ///< its limit in words, e.g. "torque of back_ubx"
  std::vector<double> parameters;  ///< grid, in segments: waypoint w is at w
  std::vector<double> times_s;     ///< time at each point of the grid; empty without a time law
  /// (ds/dt)^2 at each point of the grid, 1/s^2; linear in s between points. Empty without a time law.
  std::vector<double> speed_squares;

  static constexpr double kReducedShare = 0.8;
};

/// Computes T*, the least duration of a motion (docs/explanation/timing.md). Its points are joined by a C2 cubic spline
/// (path_spline.h). Limits are those of joint velocities, efforts and the forces of contacts that stay in place.
///
/// The grid has at least 4 intervals per piece and 32 per segment. It is halved until T* changes by less than 2 %, at
/// most twice. Whether contacts stay on their targets along the curve is not checked here.
///
/// A workspace: not thread-safe.
class MotionTimer {
 public:
  static constexpr int kLeastPerPiece = 4, kLeastPerSegment = 32, kMostRefinements = 2;
  static constexpr double kGridAccuracy = 0.02;
  /// Slack of the balance at rest and in motion: forces in units of the weight, moments in weight times 1 m.
  static constexpr double kRestSlack = 1e-3, kCurveSlack = 2e-3;
  /// Largest number of points of a grid; throws InputError for motions that need more.
  static constexpr int kMostPoints = 200'000;

  /// `dataset` must outlive this object.
  explicit MotionTimer(const Dataset& dataset);

  /// `stances`: one per waypoint. `times`: of the points, increasing from 0, and containing 0, 1, .. exactly;
  /// `points`: configurations, n + 7 each, finite. Throws InputError if the numbers of them do not fit.
  MotionTiming Compute(std::span<const Stance* const> stances, std::span<const double> times,
                       std::span<const Eigen::VectorXd> points);

 private:
  /// Contacts of one part of a motion, with the forces that they can transmit.
  struct Part {
    Stance contacts;
    StanceForces forces, reduced;
  };

  Part MakePart(const Stance& contacts) const;
  std::vector<double> Grid(std::span<const double> times, int refinement) const;
  PathLimits Limits(const PathSpline& spline, const std::vector<double>& grid, bool reduced);
  std::string Name(const TimeBlock& block, const std::vector<double>& grid) const;
  void Report(const std::vector<double>& grid, const TimeLaw& law, MotionTiming* timing) const;

  const Dataset& dataset_;
  PhaseSetBuilder builder_, reduced_builder_;
  CurvePoint point_;
  std::vector<Part> segments_;  ///< contacts that stay in place on each segment
  std::vector<Part> ends_;      ///< contacts of the first and the last waypoint
};

}  // namespace legopt
