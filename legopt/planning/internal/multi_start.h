#pragma once

#include <Eigen/Core>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "legopt/solvers/solver.h"

namespace legopt {

/// Settings of all attempts at one program.
struct MultiStartSettings {
  int max_restarts = 0;  ///< maximum number of attempts beyond the first, >= 0
  /// Returns the generator of an attempt; 0 is the first one.
  std::function<std::mt19937_64(int restart)> generator;
  /// Turns the original initial guess into that of a restart.
  std::function<void(std::mt19937_64& generator, Eigen::VectorXd& x)> perturb;
  /// Called after each attempt with the number of attempts made; may be empty.
  std::function<void(int attempts)> attempted;
  StopCheck stop;                                   ///< called by the solver; a stop ends all attempts; may be empty
  std::vector<IterationRecord>* history = nullptr;  ///< may be null
  StepStamp stamp = {};  ///< completes its records, except for the number of the restart; may be empty
};

/// Best of the attempts.
struct MultiStartResult {
  SolverResult best;  ///< feasible before infeasible, then smaller violation; status of a stop, if there was one
  Eigen::VectorXd x;  ///< point of `best`
  int restarts = 0;   ///< attempts made beyond the first
  Effort effort;      ///< effort of all attempts

  /// Returns whether a stop check ended the attempts.
  bool stopped() const { return IsStopped(best.status); }
};

/// Returns the name of the term with the largest violation; empty if the result is feasible or has no such term.
std::string WorstTermName(const Program& program, const SolverResult& result);

/// Returns "largest violation: " and that name; empty without a name.
std::string WorstTerm(const std::string& name);

/// Makes one attempt from `start`, then up to max_restarts from perturbed copies of it, until one ends feasible.
MultiStartResult SolveWithRestarts(Solver& solver, Program& program, const Eigen::VectorXd& start,
                                   const MultiStartSettings& settings);

}  // namespace legopt
