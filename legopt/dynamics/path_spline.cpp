#include "legopt/dynamics/path_spline.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "legopt/robot/configuration.h"
#include "legopt/types/invariant.h"

namespace legopt {
namespace {

constexpr Eigen::Index kQuaternion = 4;

/// Returns second derivatives at the points: the tridiagonal system of continuous first derivatives, by elimination.
Eigen::MatrixXd NaturalBends(const std::vector<double>& times, const Eigen::MatrixXd& points) {
  const Eigen::Index n = points.cols();
  Eigen::MatrixXd bends = Eigen::MatrixXd::Zero(points.rows(), n);
  std::vector<double> diagonal(times.size(), 1.0);
  const auto width = [&](Eigen::Index i) { return times[static_cast<size_t>(i) + 1] - times[static_cast<size_t>(i)]; };
  const auto slope = [&](Eigen::Index i) -> Eigen::VectorXd { return (points.col(i + 1) - points.col(i)) / width(i); };
  for (Eigen::Index i = 1; i + 1 < n; ++i) {
    const double factor = i == 1 ? 0.0 : width(i - 1) / diagonal[static_cast<size_t>(i) - 1];
    diagonal[static_cast<size_t>(i)] = 2.0 * (width(i - 1) + width(i)) - factor * width(i - 1);
    bends.col(i) = 6.0 * (slope(i) - slope(i - 1)) - factor * bends.col(i - 1);
  }
  for (Eigen::Index i = n - 2; i >= 1; --i) {
    bends.col(i) = (bends.col(i) - width(i) * bends.col(i + 1)) / diagonal[static_cast<size_t>(i)];
  }
  return bends;
}

Eigen::Quaterniond QuaternionOf(const Eigen::VectorXd& v) {
  const auto q = v.tail<kQuaternion>();
  return {q[0], q[1], q[2], q[3]};
}

}  // namespace

PathSpline::PathSpline(std::vector<double> times, std::span<const Eigen::VectorXd> points) : times_(std::move(times)) {
  CheckInvariant(points.size() >= 2 && points.size() == times_.size(), "a spline has a time for each of its points");
  points_.resize(points.front().size(), std::ssize(points));
  for (Eigen::Index i = 0; i < points_.cols(); ++i) {
    points_.col(i) = points[static_cast<size_t>(i)];
    auto quaternion = points_.col(i).tail<kQuaternion>();
    quaternion.normalize();
    if (i > 0 && quaternion.dot(points_.col(i - 1).tail<kQuaternion>()) < 0.0) quaternion = -quaternion;
  }
  bends_ = NaturalBends(times_, points_);
}

void PathSpline::Evaluate(double s, CurvePoint* point) const {
  const auto next = std::upper_bound(times_.begin() + 1, times_.end() - 1, s);
  const auto i = static_cast<Eigen::Index>(next - times_.begin()) - 1;
  const double h = *next - *(next - 1), a = (*next - s) / h, b = 1.0 - a;
  const auto from = points_.col(i), to = points_.col(i + 1), bend_from = bends_.col(i), bend_to = bends_.col(i + 1);
  point->x = a * from + b * to + (h * h / 6.0) * ((a * a * a - a) * bend_from + (b * b * b - b) * bend_to);
  const Eigen::VectorXd first =
      (to - from) / h + (h / 6.0) * ((3.0 * b * b - 1.0) * bend_to - (3.0 * a * a - 1.0) * bend_from);
  const Eigen::VectorXd second = a * bend_from + b * bend_to;
  const Eigen::Index linear = point->x.size() - kQuaternion;
  point->velocity.resize(linear + 3);
  point->bend.resize(linear + 3);
  point->velocity.head(linear) = first.head(linear);
  point->bend.head(linear) = second.head(linear);
  const Eigen::Quaterniond Q = QuaternionOf(point->x), dQ = QuaternionOf(first), ddQ = QuaternionOf(second);
  const double norm = Q.squaredNorm();
  const Eigen::Vector3d spin = (2.0 / norm) * (dQ * Q.conjugate()).vec();
  point->velocity.tail<3>() = spin;
  point->bend.tail<3>() =
      (2.0 / norm) * (ddQ * Q.conjugate()).vec() - (2.0 * Q.coeffs().dot(dQ.coeffs()) / norm) * spin;
  point->x.tail<kQuaternion>().normalize();
}

}  // namespace legopt
