#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "legopt/optimize/penalty_options.h"
#include "legopt/optimize/solver.h"

namespace legopt {

/// The outer loop of methods that improve the penalty objective F + mu V in epochs: raises mu until the constraints
/// hold, and within each mu runs epochs until the exact objective no longer improves. What an epoch is, the method
/// says.
///
/// The whole solve ends at the first mu whose epochs end with the constraints satisfied; the epochs of a mu end after
/// `max_epochs_without_improvement` of them (paper), sooner when the constraints are satisfied, or after `max_epochs`,
/// which counts as done - but then a feasible result is reported as kIterationLimit. Each mu ends at the point of the
/// lowest objective that its epochs visited. See docs/readings.md#when-a-solve-ends.
class PenaltySolver : public Solver {
 public:
  SolverResult Solve(Program& program, Eigen::VectorXd& x, const SolverContext& context) final;

 protected:
  /// Options as checked by Method::Validate; not looked at again.
  explicit PenaltySolver(const PenaltyOptions& options) : options_(options) {}

  /// How an epoch ended.
  enum class EpochEnd {
    kDone,         ///< another epoch may get further
    kStuck,        ///< another epoch would end where this one did
    kInterrupted,  ///< NextIteration() said no: the solve is over
  };

  /// A new problem: sizes buffers.
  virtual void Prepare(Program& program) = 0;
  /// A new mu, or a new start after the terms stopped being finite: forgets moments, memory and step lengths.
  virtual void Restart(Program& program) = 0;
  /// Moves x within the bounds: one pass over all terms. Asks NextIteration() before every iteration and says Visit()
  /// at the end of the pass, or oftener where the exact value is known anyway; ends when one of them says no.
  virtual EpochEnd Epoch(Program& program, Eigen::VectorXd& x) = 0;

  /// Counts an iteration; false when the solve is stopped.
  bool NextIteration();
  /// Takes note of an iterate and its exact value; false when that is not finite.
  bool Visit(const Eigen::VectorXd& x, const ObjectiveValue& value);
  /// Of the solve at hand; valid within Prepare(), Restart() and Epoch().
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
  int Patience() const;  ///< epochs without improvement at lowest_
  bool Satisfied(const ObjectiveValue& value) const { return value.max_violation < options_.constraint_tolerance; }
  /// True when a is the better one to return: feasible first; then the lower cost, or the smaller violation.
  bool Better(const ObjectiveValue& a, const ObjectiveValue& b) const;

  PenaltyOptions options_;
  const SolverContext* context_ = nullptr;
  double penalty_ = 0.0;
  int iterations_ = 0;
  std::optional<SolveStatus> stop_status_;  ///< what the stop check said
  Eigen::VectorXd x_;
  bool finite_ = true;  ///< the last visited point's terms are
  Candidate lowest_;    ///< of the objective at this mu
  Candidate best_;      ///< of the solve
  std::vector<double> scratch_;
};

}  // namespace legopt
