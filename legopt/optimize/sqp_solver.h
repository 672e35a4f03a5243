#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <vector>

#include "legopt/optimize/convex_subproblem.h"
#include "legopt/optimize/penalty_objective.h"
#include "legopt/optimize/solve_outcome.h"
#include "legopt/optimize/sqp_options.h"
#include "legopt/problem/program.h"

namespace legopt {

/// Asked between iterations: kNotRun to go on, or the status to stop with (kTimeLimit, kCancelled).
using StopCheck = std::function<SolveStatus()>;

/// Sequential quadratic programming with l1 penalties in a trust box, as in TrajOpt (reference 3.2), with the paper's
/// penalties mu = 1e2 .. 1e12. Three nested loops:
///
///   penalty loop       raises mu until the constraints hold
///     convexify loop   builds convex models of all terms at x
///       trust region   solves the subproblem in [x - s, x + s] until a step is accepted
///
/// Deviations from TrajOpt's text are the recommended readings: tolerance per component (17), the whole solve ends at
/// the first mu whose inner loop ends with the constraints satisfied (23), an inner loop that reaches its iteration
/// limit counts as done (27) - but a feasible point at which the loop had not converged is reported as kIterationLimit.
/// A step to a non-finite point is rejected.
///
/// One thread; no allocation inside an iteration once buffers have grown (history excepted).
class SqpSolver {
 public:
  struct Result {
    SolveStatus status = SolveStatus::kNotRun;
    ObjectiveValue value;   ///< at the returned point
    bool feasible = false;  ///< every violation below the tolerance, converged or not
    int iterations = 0;     ///< trial steps
  };

  explicit SqpSolver(const SqpOptions& options);

  /// Starts from x (size num_waypoints * point_size) and leaves the best point there. Trial steps are appended to
  /// `history` (may be null).
  Result Solve(Program& program, Eigen::VectorXd& x, const StopCheck& stop, std::vector<IterationRecord>* history);

 private:
  enum class InnerEnd { kConverged, kIterationLimit, kStopped, kFailed };
  enum class StepEnd { kAccepted, kConverged, kStopped, kFailed };

  void Prepare(const Program& program);
  InnerEnd ConvexifyLoop(Program& program, Eigen::VectorXd& x);
  StepEnd TrustRegionLoop(Program& program, Eigen::VectorXd& x);
  void Convexify(Program& program);
  bool SolveSubproblem(const Program& program, const Eigen::VectorXd& x);
  bool Satisfied() const { return value_.max_violation < options_.constraint_tolerance; }
  SolveStatus FinalStatus() const;

  SqpOptions options_;
  std::unique_ptr<SubproblemSolver> subproblem_solver_;
  std::unique_ptr<ConvexSubproblem> subproblem_;
  std::vector<LinearModel> models_;  ///< one per term
  std::vector<double> scratch_;
  Eigen::VectorXd dx_, lower_, upper_, x_trial_;
  const StopCheck* stop_ = nullptr;
  std::vector<IterationRecord>* history_ = nullptr;
  ObjectiveValue value_;  ///< exact, at x
  double penalty_ = 0.0, trust_box_ = 0.0;
  int iterations_ = 0;
  SolveStatus stop_status_ = SolveStatus::kNotRun;
  bool hit_iteration_limit_ = false;
};

}  // namespace legopt
