#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "client/report/listing.h"
#include "legopt/dataset/dataset.h"
#include "legopt/judge/solution_file.h"
#include "legopt/types/check.h"
#include "legopt/types/enum_names.h"

namespace legopt {
namespace client {

/// Rows of a listing of pushes.
enum class PushRows {
  kMethods,  ///< one row per method
  kProblems  ///< one row per solution
};

}  // namespace client

template <>
inline constexpr auto kEnumNames<client::PushRows> = MakeEnumNames<client::PushRows>(
    {{client::PushRows::kMethods, "methods"}, {client::PushRows::kProblems, "problems"}});

}  // namespace legopt

namespace legopt::client {

/// Success of a solution, the effort that its waypoints take, and the horizontal pushes at the centre of mass that they
/// resist in all of kPushDirections (docs/explanation/contacts.md#push).
struct PushedSolution {
  static constexpr double kNotHeld = -std::numeric_limits<double>::infinity();

  std::string method;
  int problem_id = 0;
  int num_waypoints = 0;
  std::string fault;                    ///< reason why the solution cannot be read; empty if it can
  Verdict verdict = Verdict::kSuccess;  ///< verdict of the physical rule
  /// Largest share of an effort limit over the waypoints, for the contact forces that make it least
  /// (TorqueRatio::ratio); infinite if a waypoint has no equilibrium.
  double effort_share = 0.0;
  /// Least push over the waypoints that forces within friction and torques within effort limits resist, N: the figure
  /// of the check `push`. kNotHeld if a waypoint cannot be held as it is.
  double push_N = kNotHeld;
  double contacts_N = kNotHeld;   ///< least push by contact forces alone, N
  double weight_N = 0.0;          ///< weight of the robot
  int waypoint = -1;              ///< waypoint with the least push_N
  int direction_deg = 0;          ///< its direction, from the world's x axis; where contacts and efforts resist least
  std::optional<double> asked_N;  ///< largest push that a stance of the problem asks for
};

/// Judges all solutions of a file and computes their efforts and pushes, in its order, on `threads` threads. Joints
/// count as clamped to their limits, as for the judge. Problems without a definition in the file use the dataset's.
/// Throws InputError for a problem that neither defines.
std::vector<PushedSolution> PushSolutions(const SolutionFile& file, const Dataset& dataset, int threads);

/// Returns one row per solution. Pushes in N; nulls where a waypoint cannot be held.
Listing ListingOf(const std::vector<PushedSolution>& solutions);

/// Returns one row per method: solutions, those that succeed, those that are held, and figures of the latter.
Listing SummaryOf(const std::vector<PushedSolution>& solutions);

}  // namespace legopt::client
