#pragma once

#include <Eigen/Core>

#include "legopt/solvers/line_search.h"
#include "legopt/solvers/smooth_objective.h"

namespace legopt {

/// phi(alpha) = F(P_C(x - alpha d)), with P_C the projection on the variables' bounds
/// (docs/explanation/paper.md#line-search). F is the sum over the terms of a mask and, if models are given, over the
/// models of the other terms. The value is exact. The slope is the directional derivative over the variables that are
/// not at a bound. A workspace; one thread.
class ProjectedLine : public LineFunction {
 public:
  /// Sets a program and its smoothed objective, both of which must outlive all later calls.
  void Reset(Program& program, SmoothObjective& objective);

  /// Sets the line from x along -d; d may be filled in later. `models` are models about x of the terms outside the
  /// mask; if null, phi excludes these terms. The arguments must outlive the search.
  void Aim(const Eigen::VectorXd& x, const Eigen::VectorXd& d, const TermMask& mask, const TermModels* models);

  /// Returns phi(0) and phi'(0), given value and gradient of the mask's terms at x.
  ValueAndSlope Start(double value, const Eigen::VectorXd& gradient);
  /// Returns the alpha at which the first variable that can move has changed by `max_step`; +infinity if none can.
  double MaxAlpha(double max_step) const;

  double Value(double alpha) override;
  double Slope() override;

  double alpha() const { return alpha_; }                  ///< alpha of the last Value()
  double value() const { return value_; }                  ///< result of the last Value()
  const Eigen::VectorXd& point() const { return point_; }  ///< point at alpha()
  const Eigen::VectorXd& step() const { return step_; }    ///< step from x to point()
  /// Swaps the gradients of the mask's terms at alpha() and their sum with the arguments.
  void SwapGradients(TermGradients& of_terms, Eigen::VectorXd& sum);

 private:
  /// Returns the value of the other terms' models at step_ and sets others_ to their gradient.
  double OthersValue();
  /// Returns whether the bounds keep variable j from moving in direction `way`.
  bool Held(Eigen::Index j, double way) const { return way < 0.0 ? lower_[j] >= 0.0 : upper_[j] <= 0.0; }

  Program* program_ = nullptr;
  SmoothObjective* objective_ = nullptr;
  const Eigen::VectorXd *x_ = nullptr, *d_ = nullptr;
  const TermMask* mask_ = nullptr;
  const TermModels* models_ = nullptr;
  double alpha_ = 0.0, value_ = 0.0;
  bool has_gradient_ = false;
  Eigen::VectorXd lower_, upper_, step_, point_, gradient_;  ///< gradient_: sum of the mask's terms
  Eigen::VectorXd others_;                                   ///< gradient of the other terms
  TermGradients term_gradients_;
};

}  // namespace legopt
