#pragma once

#include <memory>
#include <span>
#include <string>

#include "legopt/optimize/method.h"
#include "legopt/optimize/option_fields.h"
#include "legopt/optimize/solver.h"

namespace legopt {

/// One solver that a method may name: the only place where a new one is entered.
struct SolverEntry {
  const char* word;        ///< value of a method's `solver`
  const char* paper_name;  ///< what tables print, without the prefix "I-" of incremental variants
  bool samples;            ///< sample_size and incremental apply
  bool draws;              ///< draws random numbers even with all terms
  double contact_range_m;  ///< default of that option: wide for solvers that linearise rows before they are violated
  void (*visit)(Method& method, OptionFields& fields);
  std::unique_ptr<Solver> (*make)(const Method& method);
};

/// All solvers, in the order of the documentation.
std::span<const SolverEntry> SolverRegistry();

/// Null when unknown.
const SolverEntry* FindSolver(const std::string& word);

/// The solver of a method that FromJson accepted.
std::unique_ptr<Solver> MakeSolver(const Method& method);

}  // namespace legopt
