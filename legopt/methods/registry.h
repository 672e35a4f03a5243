#pragma once

#include <span>
#include <string>

#include "legopt/methods/method.h"
#include "legopt/optimize/option_fields.h"

namespace legopt {

/// One solver that a method may name: its words, defaults and options. Enter a new one here, and what makes it in
/// solver_factory.cpp. This half depends on no solver, so that readers of methods (suites, fuzz targets) need none.
struct SolverEntry {
  const char* word;        ///< value of a method's `solver`
  const char* paper_name;  ///< what tables print, without the prefix "I-" of incremental variants
  bool samples;            ///< sample_size and incremental apply
  bool draws;              ///< draws random numbers even with all terms
  double contact_range_m;  ///< default of that option: wide for solvers that linearise rows before they are violated
  void (*visit)(Method& method, OptionFields& fields);
};

/// All solvers, in the order of the documentation.
std::span<const SolverEntry> SolverRegistry();

/// Null when unknown.
const SolverEntry* FindSolver(const std::string& word);

}  // namespace legopt
