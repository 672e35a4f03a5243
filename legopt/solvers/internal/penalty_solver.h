#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "legopt/solvers/penalty_options.h"
#include "legopt/solvers/solver.h"

namespace legopt {

/// The outer loop of methods that improve the penalty objective F + mu V in epochs. It raises mu until the constraints
/// hold. For each mu, it runs epochs until the exact objective no longer improves. Derived classes define an epoch.
///
/// The whole solve ends at the first mu whose epochs end with the constraints satisfied. The epochs of a mu end after
/// `max_epochs_without_improvement` (paper), sooner if the constraints are satisfied, or after `max_epochs` in all.
/// The latter counts as finished, but the solve is then reported as kIterationLimit. Each mu ends at the point of the
/// lowest objective that its epochs visited. See docs/explanation/paper.md#when-a-solve-ends.
class PenaltySolver : public Solver {
 public:
  SolverResult Solve(Program& program, Eigen::VectorXd& x, const SolverContext& context) final;

 protected:
  /// `options` must have passed Method::Validate.
  explicit PenaltySolver(const PenaltyOptions& options) : options_(options) {}

  /// End of an epoch.
  enum class EpochEnd {
    kDone,         ///< another epoch may improve further
    kStuck,        ///< another epoch would end at the same point
    kInterrupted,  ///< NextIteration() returned false: the solve is over
  };

  /// Prepares for a new program: sizes buffers.
  virtual void Prepare(Program& program) = 0;
  /// Prepares for a new mu, or for a new start after non-finite terms: resets moments, memory and step lengths.
  virtual void Restart(Program& program) = 0;
  /// Moves x within the bounds in one pass over all terms. Calls NextIteration() before every iteration, and Visit() at
  /// the end of the pass or whenever the exact value is known anyway. Ends when one of them returns false.
  virtual EpochEnd Epoch(Program& program, Eigen::VectorXd& x) = 0;

  /// Counts an iteration. Returns false if the solve must stop.
  bool NextIteration();
  /// Records an iterate and its exact value. Returns false if the value is not finite.
  bool Visit(const Eigen::VectorXd& x, const ObjectiveValue& value);
  /// Returns the context of the current solve; valid within Prepare(), Restart() and Epoch().
  const SolverContext& context() const { return *context_; }
  double penalty() const { return penalty_; }  ///< mu

 private:
  struct Candidate {
    void Take(const Eigen::VectorXd& other_x, const ObjectiveValue& other_value) {
      x = other_x;
      value = other_value;
    }
    Eigen::VectorXd x;
    ObjectiveValue value;
  };
  enum class InnerEnd { kConverged, kIterationLimit, kStopped };

  InnerEnd MinimizeAtPenalty(Program& program);
  int MaxIdleEpochs() const;  ///< maximum number of epochs without improvement at lowest_
  bool Satisfied(const ObjectiveValue& value) const { return value.max_violation < options_.constraint_tolerance; }
  /// Returns whether a is the better result: feasible first, then the lower cost or the smaller violation.
  bool Better(const ObjectiveValue& a, const ObjectiveValue& b) const;

  PenaltyOptions options_;
  const SolverContext* context_ = nullptr;
  double penalty_ = 0.0;
  int iterations_ = 0;
  std::optional<SolveStatus> stop_status_;  ///< last answer of the stop check
  Eigen::VectorXd x_;
  bool finite_ = true;  ///< the value of the last visited point is finite
  Candidate lowest_;    ///< lowest objective at the current mu
  Candidate best_;      ///< best result of the solve
  std::vector<double> scratch_;
};

}  // namespace legopt
