#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace legopt {

/// A configuration on a curve with its derivatives by the parameter s.
struct CurvePoint {
  Eigen::VectorXd x;         ///< n + 7, configuration with a unit quaternion
  Eigen::VectorXd velocity;  ///< n + 6, dx/ds as a tangent: base rotation in world axes
  Eigen::VectorXd bend;      ///< n + 6, derivative of velocity by s
};

/// C2 cubic spline through the points of a path, with natural ends: no second derivative at the first and last point.
///
/// Joints and base position are interpolated number by number. So is the base quaternion Q, with the sign of each point
/// chosen nearest to the one before; the orientation is q = Q / |Q|. Its angular velocity and acceleration in world
/// axes, per unit of s, are
///
///     w = 2 vec(Q' Q*) / |Q|^2,    dw/ds = 2 vec(Q'' Q*) / |Q|^2 - 2 (Q . Q') / |Q|^2 w
///
/// Immutable and thread-safe. Source: de Boor, A Practical Guide to Splines, chapter IV.
class PathSpline {
 public:
  /// `times`: increasing; `points`: as many, at least two, n + 7 numbers each; quaternions of any non-zero norm.
  PathSpline(std::vector<double> times, std::span<const Eigen::VectorXd> points);

  double begin() const { return times_.front(); }
  double end() const { return times_.back(); }
  const std::vector<double>& times() const { return times_; }

  /// Computes the point at s in [begin, end].
  void Evaluate(double s, CurvePoint* point) const;

 private:
  std::vector<double> times_;
  Eigen::MatrixXd points_;  ///< one column per point
  Eigen::MatrixXd bends_;   ///< second derivatives, likewise
};

}  // namespace legopt
