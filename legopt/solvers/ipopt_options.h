#pragma once

#include <cstdint>

#include "legopt/types/enum_names.h"

namespace legopt {

/// Second derivatives that are passed to Ipopt.
enum class IpoptHessian : std::uint8_t {
  kGaussNewton,    ///< Gauss-Newton matrix of the costs; constraints count as linear
  kLimitedMemory,  ///< limited-memory BFGS of costs and constraints
};

template <>
inline constexpr auto kEnumNames<IpoptHessian> = MakeEnumNames<IpoptHessian>(
    {{IpoptHessian::kGaussNewton, "gauss_newton"}, {IpoptHessian::kLimitedMemory, "limited_memory"}});

/// Strategy by which Ipopt lowers the barrier parameter. The names are Ipopt's own.
enum class IpoptBarrier : std::uint8_t {
  kMonotone,  ///< each barrier problem is solved to its tolerance first (Fiacco and McCormick)
  kAdaptive   ///< chosen in every iteration
};

template <>
inline constexpr auto kEnumNames<IpoptBarrier> = MakeEnumNames<IpoptBarrier>({{IpoptBarrier::kMonotone, "monotone"},
                                                                              {IpoptBarrier::kAdaptive, "adaptive"}});

/// Options for solving the whole problem as one nonlinear program by Ipopt. Every one is a key under `options:` of a
/// method.
///
/// Measured on 35 of LegOpt's postures with both initial guesses: every setting ends at points that the judge accepts.
/// Without damping, Gauss-Newton drifts along directions of zero cost (a free joint) up to the iteration limit. With
/// damping, four of five solves converge, at the same cost. BFGS needs twice the iterations and ends at 1.4 to 3.5
/// times the cost.
struct IpoptOptions {
  int max_iterations = 300;  ///< maximum number of Ipopt iterations in all rounds together, >= 1
  int max_rounds = 5;        ///< maximum number of nonlinear programs in a row, each with the rows found so far, >= 1
  double tolerance = 1e-6;   ///< Ipopt's optimality error (scaled), (0, 1]
  double stagnation_frac = 1e-3;       ///< converged after five iterations with a smaller relative change of F, >= 0
  double constraint_tolerance = 1e-4;  ///< largest allowed violation, (0, 1e-3]
  IpoptHessian hessian = IpoptHessian::kGaussNewton;
  double damping = 0.5;                            ///< added to the diagonal of the Gauss-Newton matrix, >= 0
  IpoptBarrier barrier = IpoptBarrier::kMonotone;  ///< `mu_strategy` of Ipopt

  /// Visits the fields under their keys in `options:` (option_fields.h).
  static void Visit(auto& options, auto& fields) {
    constexpr double kTiny = 1e-12;
    fields.Integer("max_iterations", options.max_iterations, 1, 100000);
    fields.Integer("max_rounds", options.max_rounds, 1, 1000);
    fields.Number("tolerance", options.tolerance, kTiny, 1.0);
    fields.Number("stagnation_frac", options.stagnation_frac, 0.0, 1.0);
    fields.Number("constraint_tolerance", options.constraint_tolerance, kTiny, 1e-3);
    fields.Choice("hessian", options.hessian);
    fields.Number("damping", options.damping, 0.0, 1e6);
    fields.Choice("barrier", options.barrier);
  }
};

}  // namespace legopt
