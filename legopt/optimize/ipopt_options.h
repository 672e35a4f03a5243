#pragma once

#include <string>

namespace legopt {

class OptionFields;

/// Options of the whole problem as one nonlinear program by Ipopt. Every one is a key under `options:` of a method.
///
/// Measured on 35 of LegOpt's postures, both starts: every setting ends at points that the judge accepts.
/// Gauss-Newton without damping wanders along directions that cost nothing (a free joint) up to the iteration limit;
/// with it, four of five solves converge, at the same cost. BFGS ends at 1.4 to 3.5 times the cost after twice the
/// iterations.
struct IpoptOptions {
  int max_iterations = 300;            ///< Ipopt iterations of all rounds together, >= 1
  int max_rounds = 5;                  ///< nonlinear programs in a row, each with the rows found so far, >= 1
  double tolerance = 1e-6;             ///< Ipopt's optimality error (scaled), (0, 1]
  double stagnation_frac = 1e-3;       ///< also converged when F changes by less, relatively, for five iterations; >= 0
  double constraint_tolerance = 1e-4;  ///< of each violation, (0, 1e-3]: docs/readings.md#solver-tolerance
  std::string hessian = "gauss_newton";  ///< of the costs, constraints taken as straight; or "limited_memory" (BFGS)
  double damping = 0.5;                  ///< added to the diagonal of the Gauss-Newton matrix, >= 0
  std::string barrier = "monotone";      ///< how Ipopt lowers the barrier; or "adaptive"

  void Visit(OptionFields& fields);

  bool operator==(const IpoptOptions&) const = default;
};

}  // namespace legopt
