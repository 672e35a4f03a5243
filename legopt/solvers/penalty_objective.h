#pragma once

#include <Eigen/Core>
#include <vector>

#include "legopt/problem/program.h"

namespace legopt {

/// Exact values of a program's objective at one point. The penalty objective of the paper is F + mu V; preferences add
/// to F.
struct ObjectiveValue {
  double cost = 0.0;           ///< F = sum of squares of the cost terms
  double preference = 0.0;     ///< P = sum weight max(0, p) of the preferences
  double violation = 0.0;      ///< V = sum |h| + sum max(0, g)
  double max_violation = 0.0;  ///< largest single |h_i| or max(0, g_i), which is compared with tolerances
  int worst_term = -1;         ///< index of the term with max_violation; -1 when there is none

  /// Adds the residuals of one more term.
  void Add(const TermShape& shape, int term, const std::vector<double>& residuals);

  /// Returns F + P, the objective that is minimised subject to the constraints.
  double Objective() const { return cost + preference; }
  /// Returns the penalty objective F + P + mu V, `penalty` = mu >= 0.
  double Merit(double penalty) const { return Objective() + penalty * violation; }
  /// Returns whether F, P and V are finite.
  bool IsFinite() const;
};

/// Evaluates all terms of `program` at x. `scratch` is a reusable buffer. Non-finite terms make the value non-finite.
ObjectiveValue EvaluateObjective(Program& program, Eigen::Ref<const Eigen::VectorXd> x, std::vector<double>& scratch);

}  // namespace legopt
