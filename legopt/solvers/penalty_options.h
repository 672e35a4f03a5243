#pragma once

#include <cstdint>

#include "legopt/solvers/internal/line_search.h"
#include "legopt/types/enum_names.h"

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

/// Options that CHOMP and STOMP share (waypoint_metric.h).
struct MetricOptions {
  double smoothness = 1.0;  ///< weight of the differences between waypoints, >= 0

  /// Visits the field under its key in `options:` (option_fields.h).
  static void Visit(auto& options, auto& fields) { fields.Number("smoothness", options.smoothness, 0.0, 1e9); }
};

/// Data that incremental methods remember of terms outside the batch (docs/explanation/paper.md).
enum class GradientMemory : std::uint8_t {
  kGradients,  ///< gradients at the last evaluation of each term (paper, (22))
  kModels      ///< linear models at the last evaluation, moved along with x as in I-SQP
};

template <>
inline constexpr auto kEnumNames<GradientMemory> =
    MakeEnumNames<GradientMemory>({{GradientMemory::kGradients, "gradients"}, {GradientMemory::kModels, "models"}});

/// Numerical options of gradient methods, complete for SGD. Defaults are the paper's where it states them; every one is
/// a key under `options:` of a method.
struct GradientOptions {
  PenaltyOptions penalty;
  /// w of the smooth penalties, per m or rad, > 0 (docs/explanation/paper.md#smooth-penalties). On the postures, 1e2
  /// solves more problems than 1e4 with every method, and faster; at mu >= 1e4 its optimum still meets the tolerance.
  double sharpness = 1e2;
  LineSearchOptions line_search;
  GradientMemory memory = GradientMemory::kGradients;  ///< used by incremental methods

  /// Visits the fields under their keys in `options:` (option_fields.h).
  static void Visit(auto& options, auto& fields) {
    PenaltyOptions::Visit(options.penalty, fields);
    fields.Number("sharpness", options.sharpness, 1e-3, 1e12);
    LineSearchOptions::Visit(options.line_search, fields);
    fields.ChoiceWithDefault("memory", options.memory, GradientMemory::kGradients);
  }
};

/// Decay and scale of the moments of Adam and Nadam (MomentDirection).
struct MomentOptions {
  double beta1 = 0.9;     ///< decay of the first moment (paper), [0, 1)
  double beta2 = 0.999;   ///< decay of the second moment (paper), [0, 1)
  double epsilon = 1e-8;  ///< added to the root of the second moment, > 0 (docs/explanation/paper.md#moments)

  /// Visits the fields under their keys in `options:` (option_fields.h).
  static void Visit(auto& options, auto& fields) {
    constexpr double kBelowOne = 0.999999;
    fields.Number("beta1", options.beta1, 0.0, kBelowOne);
    fields.Number("beta2", options.beta2, 0.0, kBelowOne);
    fields.Number("epsilon", options.epsilon, 1e-300, 1.0);
  }
};

/// Options of Adam and Nadam.
struct MomentGradientOptions {
  GradientOptions gradient;
  MomentOptions moments;

  /// Visits the fields under their keys in `options:` (option_fields.h).
  static void Visit(auto& options, auto& fields) {
    GradientOptions::Visit(options.gradient, fields);
    MomentOptions::Visit(options.moments, fields);
  }
};

/// Options of CHOMP; every one is a key under `options:` of a method.
struct ChompOptions {
  ChompOptions() { metric.smoothness = 100.0; }

  PenaltyOptions penalty;
  MetricOptions metric;               ///< velocity metric A of the steps
  double sharpness = 1e2;             ///< w of the smooth penalties, as in gradient methods, > 0
  double max_step = 1.0;              ///< largest change of any variable in one step; rad and m, > 0
  double sufficient_decrease = 1e-4;  ///< c1 of Armijo's condition, (0, 1)
  int max_trials = 20;                ///< maximum number of step lengths tried, each half the previous one, >= 1

  /// Visits the fields under their keys in `options:` (option_fields.h).
  static void Visit(auto& options, auto& fields) {
    PenaltyOptions::Visit(options.penalty, fields);
    MetricOptions::Visit(options.metric, fields);
    fields.Number("sharpness", options.sharpness, 1e-3, 1e12);
    fields.Number("max_step", options.max_step, 1e-6, 100.0);
    fields.Number("sufficient_decrease", options.sufficient_decrease, 1e-12, 0.5);
    fields.Integer("max_trials", options.max_trials, 1, 200);
  }
};

/// Options of STOMP; every one is a key under `options:` of a method.
struct StompOptions {
  StompOptions() {
    penalty.max_epochs = 1000;
    penalty.max_epochs_without_improvement = 30;
    penalty.max_epochs_when_satisfied = 30;
    metric.smoothness = 10.0;
  }

  PenaltyOptions penalty;         ///< longer limits than for gradient methods
  MetricOptions metric;           ///< acceleration metric R of the noise and of the updates
  int rollouts = 20;              ///< noisy points per iteration, >= 2
  double noise = 0.05;            ///< initial standard deviation at the waypoint that varies most; rad and m, > 0
  double noise_floor = 1e-5;      ///< lower limit of the standard deviation, > 0
  double noise_growth = 1.2;      ///< factor after an update that lowered the objective, up to `noise`, >= 1
  double noise_shrinkage = 0.95;  ///< factor after other updates, (0, 1)
  double selectivity = 10.0;      ///< h: a waypoint's worst rollout has e^-h times the weight of its best, > 0

  /// Visits the fields under their keys in `options:` (option_fields.h).
  static void Visit(auto& options, auto& fields) {
    PenaltyOptions::Visit(options.penalty, fields);
    MetricOptions::Visit(options.metric, fields);
    fields.Integer("rollouts", options.rollouts, 2, 10000);
    fields.Number("noise", options.noise, 1e-9, 10.0);
    fields.Number("noise_floor", options.noise_floor, 1e-12, 10.0);
    fields.Number("noise_growth", options.noise_growth, 1.0, 10.0);
    fields.Number("noise_shrinkage", options.noise_shrinkage, 0.01, 0.999);
    fields.Number("selectivity", options.selectivity, 1e-3, 1e3);
  }
};

/// Options of CMA-ES; every one is a key under `options:` of a method. The strategy's other constants are its author's
/// defaults.
struct CmaEsOptions {
  CmaEsOptions() {
    penalty.max_epochs = 5000;
    penalty.max_epochs_without_improvement = 100;
    penalty.max_epochs_when_satisfied = 100;
  }

  PenaltyOptions penalty;    ///< an epoch is one generation
  double step = 0.1;         ///< initial standard deviation of each variable, rad and m, > 0
  double step_floor = 1e-6;  ///< lower limit of the largest standard deviation of any variable, (0, step]
  /// Factor of the number of samples with each restart, >= 1; 2: IPOP-CMA-ES (Auger, Hansen, CEC 2005).
  double population_growth = 2.0;

  /// Visits the fields under their keys in `options:` (option_fields.h).
  static void Visit(auto& options, auto& fields) {
    PenaltyOptions::Visit(options.penalty, fields);
    fields.Number("step", options.step, 1e-9, 10.0);
    fields.Number("step_floor", options.step_floor, 1e-12, 10.0);
    fields.NumberWithDefault("population_growth", options.population_growth, 1.0, 10.0, 2.0);
  }
};

}  // namespace legopt
