#pragma once

#include <string>

namespace legopt::external {

/// Largest time budget of an external method: a week.
inline constexpr double kLongestBudget_s = 604'800.0;

/// Options of an external solver. Its declaration, identified by the hash, determines everything else.
struct ExternalOptions {
  std::string declaration;             ///< hash of the declaration (Declaration::hash)
  double constraint_tolerance = 1e-4;  ///< limit for each violation, (0, 1e-3]
  double budget_s = 0.0;               ///< wall time of a job after which the best point so far is the result; 0: none
  int max_rounds = 5;                  ///< nonlinear programs solved in sequence, each with the rows found so far, >= 1

  /// Keys under `options:` (option_fields.h).
  static void Visit(auto& options, auto& fields) {
    fields.Digest("declaration", options.declaration);
    fields.Number("constraint_tolerance", options.constraint_tolerance, 1e-12, 1e-3);
    fields.Integer("max_rounds", options.max_rounds, 1, 1000);
    fields.NumberWithDefault("budget_s", options.budget_s, 0.0, kLongestBudget_s, 0.0);
  }
};

}  // namespace legopt::external
