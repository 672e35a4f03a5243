#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "legopt/certify/stance_program.h"
#include "legopt/collision/collision_query.h"
#include "legopt/dataset/dataset.h"
#include "legopt/dataset/stance.h"
#include "legopt/evaluate/judge.h"
#include "legopt/optimize/sqp_solver.h"

namespace legopt::certify {

/// A posture that the judge accepts, by the literal and the strict rule.
struct FoundPosture {
  Eigen::VectorXd x;  ///< n + 7; multiples of StanceCertifier::kResolution, and accepted as such
  int start = 0;      ///< number of the start that led to it
};

/// Why no posture was found, as far as attempts can tell.
struct Obstruction {
  /// The smallest sets of groups without which one was found: all of the same size. Empty: not even with all of them
  /// left out, so it is the feet's places and the joint limits.
  std::vector<std::vector<ConstraintGroup>> without;
  std::string nearest;  ///< what the judge says of the attempt with the smallest violation, for people

  /// "without balance, or without self"; "feet and joint limits".
  std::string Describe() const;
};

/// Looks for a posture at one stance: SQP of LegOpt-best over the constraints of a single waypoint, without costs, from
/// many starts; what it ends in is judged, whatever the solver thinks of it.
///
/// Start 0 is the good initial guess. Every other has the base scattered over the feet, in units of the base's
/// nominal height above the soles: 0.2 to all sides, 0.5 to 1 high, yaw 40, roll 15, pitch -10 to 40 degrees; and the
/// joints between the nominal posture and anywhere within their limits. Starts of odd number use up
/// the judge's tolerance of depth, the others keep the solvers' distance.
///
/// What it finds depends on dataset, stance and the numbers of the starts only. A workspace: one thread. Stances must
/// be of feet of the dataset (InputError).
class StanceCertifier {
 public:
  /// Postures are rounded to it before they are judged, so that files are small; rad, m, 1.
  static constexpr double kResolution = 1e-6;
  /// Attempts at each set of groups that Explain leaves out.
  static constexpr int kExplainingStarts = 200;

  /// Asked between iterations; true: end soon, with nothing. May be empty.
  using Stop = std::function<bool()>;

  /// Builds the dataset's collision model if nobody has yet; throws InputError when a mesh is corrupt.
  explicit StanceCertifier(std::shared_ptr<const Dataset> dataset);

  /// The first posture from the starts with numbers first <= k < last.
  std::optional<FoundPosture> Search(const Stance& stance, int first, int last, const Stop& stop);
  /// The first posture from starts that are given, n + 7 each; `start` is the index among them.
  std::optional<FoundPosture> SearchFrom(const Stance& stance, std::span<const Eigen::VectorXd> starts,
                                         const Stop& stop);
  /// Leaves out ever larger sets of groups until something is found, from `starts` <= kExplainingStarts starts each.
  Obstruction Explain(const Stance& stance, int starts, const Stop& stop);
  /// Whether the judge accepts the posture, by the literal and the strict rule.
  bool Accepts(const Stance& stance, const Eigen::VectorXd& x);

 private:
  struct Attempt {
    double violation = 0.0;  ///< by the solver
    bool feasible = false;   ///< likewise
    bool stopped = false;    ///< half-way: what it has may not count, or interruptions would decide results
  };

  Eigen::VectorXd Start(const Stance& stance, int number) const;
  Attempt Solve(StanceProgram& program, Eigen::VectorXd& x, const Stop& stop);
  bool FindsWithout(const Stance& stance, ConstraintGroups left_out, int starts, const Stop& stop);
  std::string Nearest(const Stance& stance, int starts, const Stop& stop);
  Evaluation JudgePosture(const Stance& stance, const Eigen::VectorXd& x);

  std::shared_ptr<const Dataset> dataset_;
  CollisionQuery query_;
  Judge judge_;
  SqpSolver solver_;
};

}  // namespace legopt::certify
