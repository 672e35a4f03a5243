#pragma once

#include <string>

namespace legopt {

/// A function of one variable along a search direction, alpha >= 0.
class LineFunction {
 public:
  virtual ~LineFunction() = default;
  virtual double Value(double alpha) = 0;  ///< value at alpha; not finite where undefined
  virtual double Slope() = 0;              ///< derivative at the alpha of the last Value()
};

/// Options of SearchWolfe and of the step lengths of gradient methods.
struct LineSearchOptions {
  double sufficient_decrease = 1e-4;  ///< c1 of Wolfe's conditions (paper), (0, 1)
  double curvature = 0.9;             ///< c2 (paper), (c1, 1)
  double max_step = 1.0;              ///< largest change of any variable in one step; rad and m, > 0
  double short_step =
      1e-3;             ///< largest change if no Wolfe point is found, >= 0 (docs/explanation/paper.md#line-search)
  int max_trials = 20;  ///< maximum number of evaluations per search, >= 1

  /// Visits the fields under their keys in `options:` (option_fields.h).
  static void Visit(auto& options, auto& fields) {
    fields.Number("sufficient_decrease", options.sufficient_decrease, 1e-12, 0.5);
    fields.Number("curvature", options.curvature, 1e-6, 0.999);
    fields.Number("max_step", options.max_step, 1e-6, 100.0);
    fields.Number("short_step", options.short_step, 0.0, 1.0);
    fields.Integer("max_trials", options.max_trials, 1, 200);
    fields.Require(options.curvature > options.sufficient_decrease, "curvature", "sufficient_decrease",
                   std::to_string(options.curvature), "must exceed sufficient_decrease",
                   "raise it or lower sufficient_decrease");
  }
};

/// Start of a line search.
struct LineStart {
  double value = 0.0;        ///< phi(0), finite
  double slope = 0.0;        ///< phi'(0), < 0
  double first_alpha = 1.0;  ///< first step to try, > 0; cut at max_alpha
  double max_alpha = 1.0;    ///< longest step, > 0; +infinity: no limit
};

/// Result of a line search.
struct LineSearchResult {
  double alpha = 0.0;  ///< 0: no point with sufficient decrease was found
  double value = 0.0;  ///< phi(alpha)
  bool wolfe = false;  ///< both conditions hold; else the lowest point found with sufficient decrease
};

/// Finds a step length by bracketing and zooming (Nocedal and Wright, algorithms 3.5 and 3.6) that satisfies Wolfe's
/// strong conditions:
///     phi(a) <= phi(0) + c1 a phi'(0),   |phi'(a)| <= c2 |phi'(0)|.
/// Non-finite values count as too high. A step of max_alpha with sufficient decrease is accepted whatever its slope.
LineSearchResult SearchWolfe(LineFunction& phi, const LineStart& start, const LineSearchOptions& options);

}  // namespace legopt
