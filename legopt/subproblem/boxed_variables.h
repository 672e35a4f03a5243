#pragma once

#include <cstddef>
#include <vector>

namespace legopt {

/// Variables v in boxes [lower, upper] with the multipliers of both sides, as an interior-point method moves them:
///
///     z_lower (v - lower) = z_upper (upper - v) = sigma,    z >= 0
///
/// Both sides of the solver's saddle point are such variables. Arrays have `size()` entries, a multiple of four; fixed
/// variables and the rest of the last four have zero multipliers and steps and never limit anything.
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

  /// To be called when values have been set. From here on the slacks v - lower and upper - v are moved along with v:
  /// their differences would round to zero near a bound long before the method is done with it.
  void Start();
  /// sum of the complementarity products.
  double Gap() const;
  /// The same after a step of length `length` along the direction at hand.
  double GapAfter(double length) const;
  /// theta_i = z_lower / (v - lower) + z_upper / (upper - v).
  void BarrierHessian(std::vector<double>& theta) const;
  /// Right-hand sides of the complementarity equations for the target `sigma`, with the second-order terms of the
  /// direction at hand if `corrector`. Fills `drive`.
  void Aim(double sigma, bool corrector);
  /// Multiplier steps that go with `step`.
  void CompleteDirection();
  /// max(1, 1 / longest step that keeps all slacks and multipliers non-negative).
  double InverseMaxStep() const;
  /// v and the multipliers move by `length` times their steps, the slacks with them. 0 <= length <= 1 /
  /// InverseMaxStep().
  void Move(double length);

  std::vector<double> value,  ///< v; filled by the method between Reset() and Start(), like the next four
      lower,                  ///< lower bounds
      upper,                  ///< upper bounds
      z_lower,                ///< multipliers of v >= lower, >= 0
      z_upper;                ///< multipliers of v <= upper, >= 0
  std::vector<double> free;   ///< 1 or 0
  std::vector<double> step;   ///< of value
  std::vector<double> drive;  ///< what the complementarity targets add to the right-hand side of v's equation

 private:
  void InvertSlacks();

  std::vector<double> below_, above_;                  // slacks
  std::vector<double> inverse_below_, inverse_above_;  // of the slacks
  std::vector<double> z_lower_step_, z_upper_step_;    // right-hand sides between Aim and CompleteDirection
};

}  // namespace legopt
