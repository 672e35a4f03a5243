#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "legopt/problem/program.h"
#include "legopt/solvers/internal/line_search.h"
#include "legopt/solvers/internal/term_sampler.h"
#include "legopt/solvers/solver.h"

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

/// Selection of the terms of a sum: entry i is nonzero if term i is included.
using TermMask = std::vector<std::uint8_t>;

/// One gradient per term, in the tangent spaces of the waypoints that the term touches (num_waypoints * tangent_size).
class TermGradients {
 public:
  /// Sets all gradients to zero, for the terms of `program`.
  void Reset(const Program& program);

  Eigen::VectorXd& of_term(size_t k) { return by_term_[k]; }  ///< gradient of term k

  /// Sets `sum` to the gradients of the terms in `mask`, added in the order of the terms; num_waypoints *
  /// tangent_size of the program.
  void Sum(const Program& program, const TermMask& mask, Eigen::VectorXd& sum) const;

 private:
  std::vector<Eigen::VectorXd> by_term_;
};

/// The paper's smoothed penalty objective sum_i F_i, with F_i = f_i for costs and mu p(.) for constraints
/// (smooth_objective.h), over any subset of the terms. A workspace; one thread.
class SmoothObjective {
 public:
  /// Sets the program, which must outlive all later calls, and w > 0 of the smooth penalties.
  void Reset(Program& program, double sharpness);
  void set_penalty(double mu) { penalty_ = mu; }  ///< mu >= 0, for later values and gradients

  /// Moves to x and returns the sum of the terms in `mask`; not finite if a term is not.
  double Value(Eigen::Ref<const Eigen::VectorXd> x, const TermMask& mask);

  /// Returns Value() and computes the gradients and models of the terms in `mask`; evaluates each term once.
  double ValueAndGradients(Eigen::Ref<const Eigen::VectorXd> x, const TermMask& mask, TermGradients& gradients,
                           TermModels& models);

  /// Returns the smoothed sum of the models of the terms that are *not* in `mask`, at dx from the models' point, and
  /// adds its gradient to `gradient`. Evaluates no term.
  double ModelValue(const TermModels& models, const TermMask& mask, const Eigen::VectorXd& dx,
                    Eigen::VectorXd& gradient) const;

  /// Exact values of the terms that the last Value() or ValueAndGradients() summed.
  const ObjectiveValue& exact() const { return exact_; }

  /// Computes the gradients of the terms in `mask` at the point of the last Value().
  void Gradients(const TermMask& mask, TermGradients& gradients);

 private:
  /// Adds the rows in residuals_ of term k to exact_ and returns their smoothed share.
  double AddShare(size_t k);
  /// Computes model and gradient of term k at the program's point.
  void LinearizeTerm(size_t k, LinearModel& model, Eigen::VectorXd& gradient);

  Program* program_ = nullptr;
  double sharpness_ = 1.0, penalty_ = 1.0;
  ObjectiveValue exact_;
  std::vector<double> residuals_;
  LinearModel model_;
};

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
