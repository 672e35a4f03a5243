#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "legopt/solvers/internal/term_sampler.h"
#include "legopt/solvers/solver.h"
#include "legopt/solvers/sqp_options.h"
#include "legopt/solvers/subproblem/convex_subproblem.h"

namespace legopt {

/// Sequential quadratic programming with l1 penalties in a trust box, as in TrajOpt (docs/explanation/paper.md#sqp),
/// with the paper's penalties mu = 1e2 .. 1e12. Three nested loops:
///
///   penalty loop       raises mu until the constraints hold
///     convexify loop   builds convex models of all terms at x
///       trust region   solves the subproblem in [x - s, x + s] until a step is accepted
///
/// Unlike in TrajOpt (docs/explanation/paper.md#when-a-solve-ends), the tolerance is per component, and the whole solve
/// ends at the first mu whose inner loop ends with the constraints satisfied. An inner loop that reaches its iteration
/// limit counts as finished, but the solve is then reported as kIterationLimit. A step to a non-finite point is
/// rejected.
///
/// With a sample below 100 %, the convexify loop refreshes a random subset of the terms. **Incremental** (I-SQP;
/// docs/explanation/paper.md#incremental-sqp): the first convexification at each mu uses all terms. Later ones keep the
/// models of terms outside the sample, moved along with x. The loop ends as soon as the constraints hold after an
/// accepted step (unless `stop_when_feasible` differs), and convergence is only declared on fresh models of all terms.
/// **Not incremental** (SQP 80 %): the subproblem contains only the sampled terms. In both cases, the full merit
/// decides whether a step is accepted.
class SqpSolver : public Solver {
 public:
  /// `options` must have passed Method::Validate.
  explicit SqpSolver(const SqpOptions& options, const Sampling& sampling = {});

  SolverResult Solve(Program& program, Eigen::VectorXd& x, const SolverContext& context) override;

 private:
  enum class InnerEnd { kConverged, kIterationLimit, kStopped, kFailed };
  enum class StepEnd { kAccepted, kConverged, kStopped, kFailed };
  /// kGood: accepted, and the model's prediction was good.
  enum class Step { kGood, kAccepted, kRejected };

  void Prepare(const Program& program);
  InnerEnd ConvexifyLoop(Program& program, Eigen::VectorXd& x);
  StepEnd TrustRegionLoop(Program& program, Eigen::VectorXd& x);
  /// Evaluates x + dx_ and, if the step is accepted, sets value_ to its value; x does not change.
  Step TryStep(Program& program, const Eigen::VectorXd& x, double predicted);
  /// Returns whether a predicted decrease of the merit is too small to continue.
  bool TooSmall(double predicted) const;
  void ResizeTrustBox(Step step);
  /// Selects the terms of the next subproblem and updates their models.
  void Convexify(Program& program, const Eigen::VectorXd& x, bool refresh_all);
  void BuildSubproblem(const Program& program);
  bool SolveSubproblem(const Program& program, const Eigen::VectorXd& x);
  bool Satisfied() const { return value_.max_violation < options_.constraint_tolerance; }
  /// Returns whether the inner loop ends as soon as the constraints hold.
  bool StopsWhenFeasible() const;
  double RestartedTrustBox() const;
  /// Returns the status of a solve whose last inner loop ended with `end`.
  SolveStatus StatusAfter(InnerEnd end) const;

  SqpOptions options_;
  Sampling sampling_;
  TermSampler sampler_;
  std::unique_ptr<SubproblemSolver> subproblem_solver_;
  std::unique_ptr<ConvexSubproblem> subproblem_;
  TermModels models_;
  std::vector<std::uint8_t> in_subproblem_;  ///< one entry per term
  bool fresh_ = false;                       ///< all models were computed at x
  bool at_x_ = false;                        ///< the program's point is x
  std::vector<double> scratch_;
  Eigen::VectorXd zero_, dx_, lower_, upper_, x_trial_;
  const SolverContext* context_ = nullptr;
  ObjectiveValue value_;  ///< exact value at x
  double penalty_ = 0.0, trust_box_ = 0.0;
  int iterations_ = 0;
  std::optional<SolveStatus> stop_status_;  ///< last answer of the stop check
};

}  // namespace legopt
