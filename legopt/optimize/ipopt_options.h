#pragma once

#include <string>

namespace legopt {

class OptionFields;

/// Options of the whole problem as one nonlinear program by Ipopt. Every one is a key under `options:` of a method.
struct IpoptOptions {
  int max_iterations = 500;              ///< Ipopt iterations of all rounds together, >= 1
  int max_rounds = 5;                    ///< nonlinear programs in a row, each with the rows found so far, >= 1
  double tolerance = 1e-6;               ///< Ipopt's optimality error (scaled), (0, 1]
  double constraint_tolerance = 1e-4;    ///< every single violation must be below it; (0, 1e-3] (lessons, trap 5)
  std::string hessian = "gauss_newton";  ///< of the costs, constraints taken as straight; or "limited_memory" (BFGS)
  std::string barrier = "monotone";      ///< how Ipopt lowers the barrier; or "adaptive"

  void Visit(OptionFields& fields);

  bool operator==(const IpoptOptions&) const = default;
};

}  // namespace legopt
