#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "legopt/problem/program.h"
#include "legopt/solvers/penalty_objective.h"
#include "legopt/solvers/smooth_penalty.h"
#include "legopt/solvers/term_models.h"

namespace legopt {

/// Selection of the terms of a sum: entry i is nonzero if term i is included.
using TermMask = std::vector<std::uint8_t>;

/// One gradient per term, in the tangent spaces of the waypoints that the term touches (num_waypoints * tangent_size).
class TermGradients {
 public:
  /// Sets all gradients to zero, for the terms of `program`.
  void Reset(const Program& program);

  Eigen::VectorXd& of_term(size_t k) { return by_term_[k]; }  ///< gradient of term k

  /// Sets `sum` to the gradients of the terms in `mask`, added in the order of the terms; num_waypoints *
  /// tangent_size of the program.
  void Sum(const Program& program, const TermMask& mask, Eigen::VectorXd& sum) const;

 private:
  std::vector<Eigen::VectorXd> by_term_;
};

/// The paper's smoothed penalty objective sum_i F_i, with F_i = f_i for costs and mu p(.) for constraints
/// (smooth_penalty.h), over any subset of the terms. A workspace; one thread.
class SmoothObjective {
 public:
  /// Sets the program, which must outlive all later calls, and w > 0 of the smooth penalties.
  void Reset(Program& program, double sharpness);
  void set_penalty(double mu) { penalty_ = mu; }  ///< mu >= 0, for later values and gradients

  /// Moves to x and returns the sum of the terms in `mask`; not finite if a term is not.
  double Value(Eigen::Ref<const Eigen::VectorXd> x, const TermMask& mask);

  /// Returns Value() and computes the gradients and models of the terms in `mask`; evaluates each term once.
  double ValueAndGradients(Eigen::Ref<const Eigen::VectorXd> x, const TermMask& mask, TermGradients& gradients,
                           TermModels& models);

  /// Returns the smoothed sum of the models of the terms that are *not* in `mask`, at dx from the models' point, and
  /// adds its gradient to `gradient`. Evaluates no term.
  double ModelValue(const TermModels& models, const TermMask& mask, const Eigen::VectorXd& dx,
                    Eigen::VectorXd& gradient) const;

  /// Exact values of the terms that the last Value() or ValueAndGradients() summed.
  const ObjectiveValue& exact() const { return exact_; }

  /// Computes the gradients of the terms in `mask` at the point of the last Value().
  void Gradients(const TermMask& mask, TermGradients& gradients);

 private:
  /// Adds the rows in residuals_ of term k to exact_ and returns their smoothed share.
  double AddShare(size_t k);
  /// Computes model and gradient of term k at the program's point.
  void LinearizeTerm(size_t k, LinearModel& model, Eigen::VectorXd& gradient);

  Program* program_ = nullptr;
  double sharpness_ = 1.0, penalty_ = 1.0;
  ObjectiveValue exact_;
  std::vector<double> residuals_;
  LinearModel model_;
};

}  // namespace legopt
