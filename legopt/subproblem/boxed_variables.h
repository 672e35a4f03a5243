#pragma once

#include <cstddef>
#include <vector>

#include "legopt/subproblem/aligned_numbers.h"

namespace legopt {

/// Variables v in boxes [lower, upper] with the multipliers of both sides, as an interior-point method moves them:
///
///     z_lower (v - lower) = z_upper (upper - v) = sigma,    z >= 0
///
/// Both sides of the solver's saddle point are such variables. Of a Newton step, d for v, the multipliers' follow:
///
///     dz_lower = e_lower - z_lower - z_lower d / (v - lower)
///     dz_upper = e_upper - z_upper + z_upper d / (upper - v)
///
/// with e = 0 for the affine one (sigma = 0), and for the corrected one, r = d' / (v - lower), q = d' / (upper - v) of
/// the affine d',
///
///     e_lower = sigma / (v - lower) + z_lower r (1 + r)
///     e_upper = sigma / (upper - v) - z_upper q (1 - q).
///
/// Arrays have `size()` entries, a multiple of four; fixed variables and the rest of the last four have zero
/// multipliers and steps and never limit anything.
///
/// Plain data with the method's element-wise arithmetic, in whole vectors. One thread; allocates only while it grows.
class BoxedVariables {
 public:
  /// All variables fixed at zero. `count` is rounded up to whole vectors.
  void Reset(size_t count);
  /// Lets variable i move between two finite bounds, `low` < `high`.
  void SetFree(size_t i, double low, double high);
  /// Holds variable i at a value; it gets a box round it that limits nothing.
  void SetFixed(size_t i, double at);
  size_t size() const { return value.size(); }  ///< variables, rounded up to whole vectors

  /// To be called when values and multipliers have been set. From here on the slacks v - lower and upper - v are moved
  /// along with v: their differences would round to zero near a bound long before the method is done with it.
  void Start();
  double gap() const { return gap_; }  ///< sum of the complementarity products
  void UpdateGap();                    ///< after multipliers have been set otherwise than by Move()
  /// theta_i = z_lower / (v - lower) + z_upper / (upper - v).
  void BarrierHessian(AlignedDoubles& theta) const;
  /// max(1, 1 / longest part of the affine step that keeps all slacks and multipliers non-negative); `step` is set.
  double InverseMaxAffineStep() const;
  /// The gap after `length` times the affine step.
  double GapAfterAffine(double length) const;
  /// e_lower and e_upper of the corrected step; `step` is still the affine one. Fills `drive`.
  void Correct(double sigma);
  /// The multipliers' part of the corrected step, which `step` is now. Returns the same as InverseMaxAffineStep() of
  /// it.
  double CompleteDirection();
  /// v and the multipliers move by `length` times their corrected steps, the slacks with them. 0 <= length <= 1 / what
  /// CompleteDirection() has returned.
  void Move(double length);

  AlignedDoubles value,  ///< v; filled by the method between Reset() and Start(), like the next four
      lower,             ///< lower bounds
      upper,             ///< upper bounds
      z_lower,           ///< multipliers of v >= lower, >= 0
      z_upper;           ///< multipliers of v <= upper, >= 0
  AlignedDoubles free;   ///< 1 or 0
  AlignedDoubles step;   ///< of value
  AlignedDoubles drive;  ///< e_lower - e_upper: what the targets add to the right-hand side of v's equation

 private:
  double gap_ = 0.0;
  AlignedDoubles below_, above_;                  // slacks
  AlignedDoubles inverse_below_, inverse_above_;  // of the slacks; 0 of fixed variables
  AlignedDoubles z_lower_step_, z_upper_step_;    // e_lower and e_upper between Correct and CompleteDirection
};

}  // namespace legopt
