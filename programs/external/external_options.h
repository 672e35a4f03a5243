#pragma once

#include <string>

namespace legopt::external {

/// Longest budget of an external method: a week.
inline constexpr double kLongestBudget_s = 604'800.0;

/// Options of a solver of others. What it is follows from its declaration, by its hash.
struct ExternalOptions {
  std::string declaration;             ///< hash of the declaration (Declaration::hash)
  double constraint_tolerance = 1e-4;  ///< of each violation, (0, 1e-3]: docs/readings.md#solver-tolerance
  double budget_s = 0.0;               ///< wall time of a job, then the best point so far is its result; 0: none
  int max_rounds = 5;                  ///< nonlinear programs in a row, each with the rows found so far, >= 1

  /// Its keys under `options:` (option_fields.h).
  static void Visit(auto& options, auto& fields) {
    fields.Digest("declaration", options.declaration);
    fields.Number("constraint_tolerance", options.constraint_tolerance, 1e-12, 1e-3);
    fields.Integer("max_rounds", options.max_rounds, 1, 1000);
    fields.LaterNumber("budget_s", options.budget_s, 0.0, kLongestBudget_s, 0.0);
  }
};

}  // namespace legopt::external
