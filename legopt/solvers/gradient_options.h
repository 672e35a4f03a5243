#pragma once

#include <cstdint>

#include "legopt/solvers/line_search.h"
#include "legopt/solvers/penalty_options.h"
#include "legopt/types/enum_names.h"

namespace legopt {

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

}  // namespace legopt
