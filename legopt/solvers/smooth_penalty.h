#pragma once

#include <cmath>
#include <numbers>

#include "legopt/problem/program.h"

namespace legopt {

/// A scalar function and its derivative.
struct ValueAndSlope {
  double value = 0.0;  ///< f
  double slope = 0.0;  ///< f'
};

/// Returns a smooth |h| (paper, (16); docs/explanation/paper.md#smooth-penalties) with slope tanh(w h / 2) and value
///     (2/w) ln cosh(w h / 2) = |h| + (2/w) (ln(1 + e^(-w|h|)) - ln 2).
/// The right-hand side never overflows. `sharpness` is w > 0, per unit of h. The value is at most 2 ln 2 / w below |h|.
inline ValueAndSlope SmoothAbs(double h, double sharpness) {
  const double size = std::abs(h);
  const double value = size + 2.0 / sharpness * (std::log1p(std::exp(-sharpness * size)) - std::numbers::ln2);
  return {value, std::tanh(0.5 * sharpness * h)};
}

/// Returns a residual's share of the smoothed objective, without its weight: r^2, SmoothAbs(r), or
/// SmoothAbs(max(0, r)). NaN stays NaN.
inline ValueAndSlope SmoothShare(TermKind kind, double r, double sharpness) {
  if (kind == TermKind::kCost) return {r * r, 2.0 * r};
  if (kind != TermKind::kEquality && r <= 0.0) return {};
  return SmoothAbs(r, sharpness);
}

}  // namespace legopt
