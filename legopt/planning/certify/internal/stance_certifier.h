#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/problem_definition.h"
#include "legopt/geometry/collision_query.h"
#include "legopt/judge/judge.h"
#include "legopt/problem/program.h"
#include "legopt/problem/terms/task_program.h"
#include "legopt/solvers/internal/sqp_solver.h"
#include "legopt/types/result.h"

namespace legopt::certify {

/// A set of constraint groups; a value.
class ConstraintGroups {
 public:
  /// Set of `groups`; empty by default.
  constexpr ConstraintGroups(std::initializer_list<ConstraintGroup> groups = {}) {
    for (const ConstraintGroup group : groups) Add(group);
  }
  /// Adds a group.
  constexpr void Add(ConstraintGroup group) { bits_ |= Bit(group); }
  /// Returns whether the group is in the set.
  constexpr bool Has(ConstraintGroup group) const { return (bits_ & Bit(group)) != 0; }
  constexpr bool operator==(const ConstraintGroups&) const = default;

 private:
  static constexpr std::uint8_t Bit(ConstraintGroup group) {
    return static_cast<std::uint8_t>(1U << static_cast<unsigned>(group));
  }
  std::uint8_t bits_ = 0;
};

/// The constraints of one stance only, as a program of one waypoint without costs; some groups may be left out. Joint
/// limits and foot poses are always included.
///
/// A workspace; dataset and query (of the dataset's collision model) must outlive it. One thread.
class StanceProgram : public Program {
 public:
  /// `proximity` is the same as for WaypointProgram; continuous collision does not apply.
  StanceProgram(const Dataset& dataset, CollisionQuery& query, const Stance& stance, const ProgramOptions& proximity,
                ConstraintGroups left_out = {});

  int num_waypoints() const override { return 1; }
  int tangent_size() const override { return whole_.tangent_size(); }
  int point_size() const override { return whole_.point_size(); }
  /// Returns the terms that are not left out.
  const std::vector<std::unique_ptr<Term>>& terms() const override { return terms_; }
  void ClearCache() override { whole_.ClearCache(); }
  void SetPoint(Eigen::Ref<const Eigen::VectorXd> x) override { whole_.SetPoint(x); }
  void Retract(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<const Eigen::VectorXd> dx,
               Eigen::Ref<Eigen::VectorXd> x_next) const override {
    whole_.Retract(x, dx, x_next);
  }
  void PullBack(const double* dx, double* row) const override { whole_.PullBack(dx, row); }
  void StepBounds(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> lower,
                  Eigen::Ref<Eigen::VectorXd> upper) const override {
    whole_.StepBounds(x, lower, upper);
  }
  void ProjectOnBounds(Eigen::Ref<Eigen::VectorXd> x) const override { whole_.ProjectOnBounds(x); }

 private:
  WaypointProgram whole_;
  std::vector<std::unique_ptr<Term>> terms_;  ///< they refer to terms of whole_
};

/// A posture that the judge accepts by the original evaluator's rule (literal) and with every listed pair (strict).
struct FoundPosture {
  Eigen::VectorXd x;  ///< n + 7 numbers, multiples of StanceCertifier::kResolution, and accepted as such
  int start = 0;      ///< number of the start that led to it
};

/// Constraints that prevent a posture, as far as attempts can show.
struct Obstruction {
  /// The smallest sets of groups without which a posture was found; all have the same size. Empty: none was found even
  /// without all groups, so the feet's positions and the joint limits prevent it.
  std::vector<std::vector<ConstraintGroup>> without;
  std::string nearest;  ///< the judge's report on the attempt with the smallest violation, for humans

  /// Returns, for example, "without balance, or without self" or "feet and joint limits".
  std::string Describe() const;
};

/// Searches for a posture at one stance: SQP of LegOpt-best on the constraints of a single waypoint, without
/// costs, from many starts. The judge accepts or rejects the result, whatever the solver's status.
///
/// Start 0 is the good initial guess. In all others, the base is scattered over the feet, in units of the base's
/// nominal height above the contact patches: 0.2 to all sides, 0.5 to 1 high, yaw 40, roll 15, pitch -10 to 40 degrees.
/// Joints are scattered between the nominal posture and random values within their limits. Starts of odd number use the
/// judge's tolerance of depth, the others keep the solvers' distance.
///
/// The result depends on dataset, stance and the numbers of the starts only. A workspace: one thread. Stances must
/// consist of feet of the dataset (InputError).
class StanceCertifier {
 public:
  /// Rounding of postures before they are judged, which keeps files small; rad, m, 1.
  static constexpr double kResolution = 1e-6;
  /// Number of attempts for each set of groups that Explain leaves out.
  static constexpr int kExplainingStarts = 200;

  /// Called between iterations; returns true to end soon, without a result. May be empty.
  using Stop = std::function<bool()>;

  /// Builds the dataset's collision model if it does not exist yet. Throws InputError if a mesh is corrupt.
  explicit StanceCertifier(std::shared_ptr<const Dataset> dataset);

  /// Returns the first posture found from the starts with numbers first <= k < last.
  std::optional<FoundPosture> Search(const Stance& stance, int first, int last, const Stop& stop);
  /// Returns the first posture found from the given starts, n + 7 each; `start` is the index among them.
  std::optional<FoundPosture> SearchFrom(const Stance& stance, std::span<const Eigen::VectorXd> starts,
                                         const Stop& stop);
  /// Leaves out growing sets of groups until a posture is found, from `starts` <= kExplainingStarts starts each.
  Obstruction Explain(const Stance& stance, int starts, const Stop& stop);
  /// Returns whether the judge accepts the posture by both rules (see FoundPosture).
  bool Accepts(const Stance& stance, const Eigen::VectorXd& x);

 private:
  struct Attempt {
    double violation = 0.0;  ///< violation according to the solver
    bool feasible = false;   ///< feasible according to the solver
    bool stopped = false;    ///< interrupted: its result is not used, so that interruptions do not affect results
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
