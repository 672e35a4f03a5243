#pragma once

namespace legopt {

/// Options of the outer penalty loop that first-order and sampling methods share (penalty_solver.h). Every one is a key
/// under `options:` of a method.
struct PenaltyOptions {
  double initial_penalty = 1e2;             ///< mu of the first penalty iteration (paper), > 0
  double penalty_increase_ratio = 10.0;     ///< factor of mu between penalty iterations, > 1
  int max_penalty_iterations = 11;          ///< mu = 1e2 .. 1e12 (paper), 1..20
  double constraint_tolerance = 5e-4;       ///< largest allowed violation, (0, 1e-3]
  int max_epochs = 500;                     ///< passes over all terms per penalty value, >= 1
  int max_epochs_without_improvement = 10;  ///< epochs without a decrease of F + mu V before mu is raised (paper), >= 1
  int max_epochs_when_satisfied = 1;        ///< limit for epochs without improvement while the constraints hold, >= 1
  double min_improve_frac = 1e-3;           ///< smallest relative decrease that counts as an improvement, [0, 1)

  /// Visits the fields under their keys in `options:` (option_fields.h).
  static void Visit(auto& options, auto& fields) {
    constexpr double kTiny = 1e-12;
    constexpr double kHuge = 1e15;
    fields.Number("initial_penalty", options.initial_penalty, kTiny, kHuge);
    fields.Number("penalty_increase_ratio", options.penalty_increase_ratio, 1.001, 1e6);
    fields.Integer("max_penalty_iterations", options.max_penalty_iterations, 1, 20);
    fields.Number("constraint_tolerance", options.constraint_tolerance, kTiny, 1e-3);
    fields.Integer("max_epochs", options.max_epochs, 1, 100000);
    fields.RemovedKey("max_iterations",
                      "write max_epochs: passes over all terms, as many as iterations at sample_size 100");
    fields.Integer("max_epochs_without_improvement", options.max_epochs_without_improvement, 1, 1000);
    fields.Integer("max_epochs_when_satisfied", options.max_epochs_when_satisfied, 1, 1000);
    fields.Number("min_improve_frac", options.min_improve_frac, 0.0, 0.99);
  }
};

}  // namespace legopt
