#pragma once

#include <Eigen/Core>

#include "legopt/optimize/line_search.h"
#include "legopt/optimize/smooth_objective.h"

namespace legopt {

/// phi(alpha) = F(P_C(x - alpha d)), with P_C the projection on the variables' bounds (docs/readings.md#line-search),
/// over the terms of a mask and, where models are given, over the others by their models. The value is true, the slope
/// is the directional derivative over the variables that are not at a bound. A workspace; one thread.
class ProjectedLine : public LineFunction {
 public:
  /// For a program and its smoothed objective, both of which must outlive the use that follows.
  void Reset(Program& program, SmoothObjective& objective);

  /// The line from x along -d, which may be filled in later. `models` of the terms that the mask leaves out are about
  /// x; null: these are no part of phi. The arguments must outlive the search.
  void Aim(const Eigen::VectorXd& x, const Eigen::VectorXd& d, const TermMask& mask, const TermModels* models);

  /// phi(0) and phi'(0), given value and gradient of the mask's terms at x.
  ValueAndSlope Start(double value, const Eigen::VectorXd& gradient);
  /// The alpha at which the first variable that can move has changed by `max_step`; +infinity when none can.
  double MaxAlpha(double max_step) const;

  double Value(double alpha) override;
  double Slope() override;

  double alpha() const { return alpha_; }                  ///< of the last Value()
  double value() const { return value_; }                  ///< the last Value()
  const Eigen::VectorXd& point() const { return point_; }  ///< at alpha()
  const Eigen::VectorXd& step() const { return step_; }    ///< from x to there
  /// Gradients of the mask's terms at alpha(), exchanged for the arguments.
  void SwapGradients(TermGradients& of_terms, Eigen::VectorXd& sum);

 private:
  /// What the others add to phi at step_, and its gradient.
  double OthersValue();
  /// True when the bounds keep variable j from moving that way.
  bool Held(Eigen::Index j, double way) const { return way < 0.0 ? lower_[j] >= 0.0 : upper_[j] <= 0.0; }

  Program* program_ = nullptr;
  SmoothObjective* objective_ = nullptr;
  const Eigen::VectorXd *x_ = nullptr, *d_ = nullptr;
  const TermMask* mask_ = nullptr;
  const TermModels* models_ = nullptr;
  double alpha_ = 0.0, value_ = 0.0;
  bool has_gradient_ = false;
  Eigen::VectorXd lower_, upper_, step_, point_, gradient_;  ///< gradient_: of the mask's terms
  Eigen::VectorXd others_;                                   ///< gradient of the others
  TermGradients term_gradients_;
};

}  // namespace legopt
