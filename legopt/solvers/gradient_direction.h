#pragma once

#include <Eigen/Core>
#include <memory>

#include "legopt/problem/program.h"
#include "legopt/solvers/gradient_options.h"

namespace legopt {

/// Rule that turns g_k, the sampled or remembered gradient, into the direction d_k of the step -alpha d_k.
class GradientDirection {
 public:
  virtual ~GradientDirection() = default;
  /// Sets k = 0 and discards all gradients.
  virtual void Reset(const Program& program) = 0;
  /// Adds a gradient and computes the next `direction`, which already has the gradient's size.
  virtual void Next(const Eigen::VectorXd& gradient, Eigen::VectorXd& direction) = 0;
  /// Returns true if the direction depends on earlier gradients.
  virtual bool remembers() const { return false; }
};

/// SGD: d = g.
class SteepestDirection : public GradientDirection {
 public:
  void Reset(const Program&) override {}
  void Next(const Eigen::VectorXd& gradient, Eigen::VectorXd& direction) override { direction = gradient; }
};

/// Adam and Nadam (paper, (18) to (20)): with m_k = beta1 m_{k-1} + (1 - beta1) g_k, v_k = beta2 v_{k-1} + (1 - beta2)
/// g_k^2, k = 1, 2, ..,
///     d = mhat / (sqrt(v_k / (1 - beta2^k)) + epsilon),   element by element,
///     Adam   mhat = m_k / (1 - beta1^k)
///     Nadam  mhat = beta1 m_k / (1 - beta1^(k+1)) + (1 - beta1) g_k / (1 - beta1^k)
class MomentDirection : public GradientDirection {
 public:
  /// Nadam if `nesterov`, else Adam.
  MomentDirection(const MomentOptions& options, bool nesterov) : options_(options), nesterov_(nesterov) {}
  void Reset(const Program& program) override;
  void Next(const Eigen::VectorXd& gradient, Eigen::VectorXd& direction) override;
  bool remembers() const override { return true; }

 private:
  MomentOptions options_;
  bool nesterov_;
  double beta1_power_ = 1.0, beta2_power_ = 1.0;  ///< beta^k
  Eigen::VectorXd first_, second_;
};

}  // namespace legopt
