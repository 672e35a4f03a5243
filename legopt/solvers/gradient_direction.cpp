#include "legopt/solvers/gradient_direction.h"

namespace legopt {

void MomentDirection::Reset(const Program& program) {
  const Eigen::Index size = static_cast<Eigen::Index>(program.num_waypoints()) * program.tangent_size();
  first_.setZero(size);
  second_.setZero(size);
  beta1_power_ = beta2_power_ = 1.0;
}

void MomentDirection::Next(const Eigen::VectorXd& gradient, Eigen::VectorXd& direction) {
  const double beta1 = options_.beta1, beta2 = options_.beta2;
  first_ = beta1 * first_ + (1.0 - beta1) * gradient;
  second_ = beta2 * second_ + (1.0 - beta2) * gradient.cwiseAbs2();
  beta1_power_ *= beta1;
  beta2_power_ *= beta2;
  double of_first = 1.0 / (1.0 - beta1_power_), of_gradient = 0.0;
  if (nesterov_) {
    of_first = beta1 / (1.0 - beta1 * beta1_power_);
    of_gradient = (1.0 - beta1) / (1.0 - beta1_power_);
  }
  direction = (of_first * first_ + of_gradient * gradient).array() /
              ((second_ / (1.0 - beta2_power_)).array().sqrt() + options_.epsilon);
}

}  // namespace legopt
