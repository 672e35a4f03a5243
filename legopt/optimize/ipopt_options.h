#pragma once

#include <cstdint>

#include "words/words.h"

namespace legopt {

/// Second derivatives that Ipopt gets.
enum class IpoptHessian : std::uint8_t {
  kGaussNewton,    ///< of the costs; constraints are taken as straight
  kLimitedMemory,  ///< BFGS of all
};

template <>
inline constexpr auto kWords<IpoptHessian> = Words<IpoptHessian>({{IpoptHessian::kGaussNewton, "gauss_newton"},
                                                                  {IpoptHessian::kLimitedMemory, "limited_memory"}});

/// How Ipopt lowers the barrier. The words are Ipopt's own.
enum class IpoptBarrier : std::uint8_t {
  kMonotone,  ///< step by step, each barrier problem solved to its tolerance (Fiacco and McCormick)
  kAdaptive   ///< anew in every iteration
};

template <>
inline constexpr auto kWords<IpoptBarrier> = Words<IpoptBarrier>({{IpoptBarrier::kMonotone, "monotone"},
                                                                  {IpoptBarrier::kAdaptive, "adaptive"}});

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
  IpoptHessian hessian = IpoptHessian::kGaussNewton;  ///< of what Ipopt's Newton steps are made
  double damping = 0.5;                               ///< added to the diagonal of the Gauss-Newton matrix, >= 0
  IpoptBarrier barrier = IpoptBarrier::kMonotone;     ///< `mu_strategy` of Ipopt

  /// Its keys under `options:` (option_fields.h).
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
