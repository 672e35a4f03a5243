#pragma once

#include <Eigen/Core>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "legopt/optimize/solver.h"

namespace legopt {

/// What the attempts at one program have in common.
struct MultiStartSettings {
  int max_restarts = 0;  ///< attempts beyond the first, >= 0
  /// The generator of an attempt; 0 is the first one.
  std::function<std::mt19937_64(int restart)> generator;
  /// Turns the original start into that of a restart.
  std::function<void(std::mt19937_64& generator, Eigen::VectorXd& x)> perturb;
  /// Called after each attempt with the number of attempts made; may be empty.
  std::function<void(int attempts)> attempted;
  StopCheck stop;  ///< asked by the solver; what ends an attempt ends them all; may be empty
  std::vector<IterationRecord>* history = nullptr;  ///< may be null
  StepStamp stamp = {};                             ///< of its records, beside the number of the restart; may be empty
};

/// The best of the attempts.
struct MultiStartResult {
  SolverResult best;  ///< feasible first, then the smaller violation; status of a stop, if there was one
  Eigen::VectorXd x;  ///< of `best`
  int restarts = 0;   ///< attempts made beyond the first
  Effort effort;      ///< of all attempts

  /// A stop check ended it.
  bool stopped() const { return IsStopped(best.status); }
};

/// Name of the term with the largest violation; empty when the result is feasible or has none.
std::string WorstTermName(const Program& program, const SolverResult& result);

/// "largest violation: " and that name; empty without one.
std::string WorstTerm(const Program& program, const SolverResult& result);

/// One attempt from `start`, then up to max_restarts from perturbed copies of it, until one ends feasible.
MultiStartResult SolveWithRestarts(Solver& solver, Program& program, const Eigen::VectorXd& start,
                                   const MultiStartSettings& settings);

}  // namespace legopt
