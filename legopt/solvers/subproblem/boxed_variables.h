#pragma once

#include <cstddef>
#include <vector>

#include "legopt/solvers/subproblem/aligned_numbers.h"

namespace legopt {

/// Variables v in boxes [lower, upper] with the multipliers of both sides, for an interior-point method:
///
///     z_lower (v - lower) = z_upper (upper - v) = sigma,    z >= 0
///
/// Primal and dual variables of the solver's saddle point have this form. Given the Newton step d of v, the steps of
/// the multipliers are
///
///     dz_lower = e_lower - z_lower - z_lower d / (v - lower)
///     dz_upper = e_upper - z_upper + z_upper d / (upper - v)
///
/// with e = 0 for the affine step (sigma = 0). The corrected step uses r = d' / (v - lower) and q = d' / (upper - v) of
/// the affine step d':
///
///     e_lower = sigma / (v - lower) + z_lower r (1 + r)
///     e_upper = sigma / (upper - v) - z_upper q (1 - q).
///
/// Arrays have `size()` entries, a multiple of four. Fixed variables and padding have zero multipliers and steps and
/// never limit a step.
///
/// Plain data with the method's element-wise arithmetic, in whole vectors. One thread; allocates only while it grows.
class BoxedVariables {
 public:
  /// Fixes all variables at zero. `count` is rounded up to whole vectors.
  void Reset(size_t count);
  /// Lets variable i move between two finite bounds, `low` < `high`.
  void SetFree(size_t i, double low, double high);
  /// Fixes variable i at a value, in a box that limits nothing.
  void SetFixed(size_t i, double at);
  size_t size() const { return value.size(); }  ///< number of variables, rounded up to whole vectors

  /// Initialises the slacks v - lower and upper - v. Must be called when values and multipliers have been set. From
  /// then on, the slacks move along with v: computed as differences, they would round to zero near a bound long before
  /// convergence.
  void Start();
  double gap() const { return gap_; }  ///< sum of the complementarity products
  void UpdateGap();                    ///< recomputes gap() after multipliers were set directly
  /// Sets theta_i = z_lower / (v - lower) + z_upper / (upper - v).
  void BarrierHessian(AlignedDoubles& theta) const;
  /// Returns max(1, 1 / t), with t the longest part of the affine step that keeps all slacks and multipliers
  /// non-negative. `step` must be set.
  double InverseMaxAffineStep() const;
  /// Returns the gap after `length` times the affine step.
  double GapAfterAffine(double length) const;
  /// Computes e_lower and e_upper of the corrected step, and `drive`. `step` must still be the affine step.
  void Correct(double sigma);
  /// Computes the multipliers' part of the corrected step, which `step` must be now. Returns its max(1, 1 / t), as
  /// InverseMaxAffineStep() does.
  double CompleteDirection();
  /// Moves v, multipliers and slacks by `length` times their corrected steps. 0 <= length <= 1 / result of
  /// CompleteDirection().
  void Move(double length);

  AlignedDoubles value,  ///< v; set by the method between Reset() and Start(), as are the next four
      lower,             ///< lower bounds
      upper,             ///< upper bounds
      z_lower,           ///< multipliers of v >= lower, >= 0
      z_upper;           ///< multipliers of v <= upper, >= 0
  AlignedDoubles free;   ///< 1 for free variables, else 0
  AlignedDoubles step;   ///< step of `value`
  AlignedDoubles drive;  ///< e_lower - e_upper, added to the right-hand side of v's equation

 private:
  double gap_ = 0.0;
  AlignedDoubles below_, above_;                  // slacks
  AlignedDoubles inverse_below_, inverse_above_;  // inverse slacks; 0 for fixed variables
  AlignedDoubles z_lower_step_, z_upper_step_;    // e_lower and e_upper between Correct and CompleteDirection
};

}  // namespace legopt
