#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/problem_definition.h"
#include "legopt/robot/kinematics.h"

namespace legopt {

/// Which pyramid of kPyramidEdges edges replaces a friction cone.
enum class FrictionPyramid {
  kInscribed,     ///< edges on the cone: forces that it permits are possible. The judge's.
  kCircumscribed  ///< faces touch the cone: forces that it forbids are impossible. For proofs about the cone.
};

inline constexpr int kPyramidEdges = 8;

/// A surface that the robot touches, with the points where forces act.
struct TouchedSurface {
  int link = 0;  ///< index into RobotModel::links()
  /// Columns: two tangents and the normal, out of the surface; orthonormal, in the world.
  Eigen::Matrix3d axes_W = Eigen::Matrix3d::Identity();
  double friction = 0.0;                  ///< Coulomb coefficient, > 0
  std::optional<double> max_normal;       ///< bound of the sum of the normal forces, in units of the weight, > 0
  std::vector<Eigen::Vector3d> points_W;  ///< m, in the world
  /// A bar that a hand grips: bound of each component of the force at each point along axes_W, in units of the weight,
  /// > 0. Replaces friction and max_normal.
  std::optional<double> max_component;
  /// Upper bound of the distance of the robot's centre of mass from any of the points, m; 0 or infinite: unknown.
  double com_reach_m = 0.0;
};

/// Returns the surfaces of the contacts that carry in a stance, with the contacts at their *targets*: friction belongs
/// to the surface, so the forces do not depend on the posture. The dataset must have the stance's contacts.
/// `kinematics`: if given, bars are gripped where this posture grips them, at most Contact::SlideOf from the target.
std::vector<TouchedSurface> SurfacesOf(const Dataset& dataset, const Stance& stance,
                                       const Kinematics* kinematics = nullptr);

/// Returns true if a contact that carries may slide along its bar, so that forces depend on the posture.
bool SlidesUnderLoad(const Dataset& dataset, const Stance& stance);

/// The forces that surfaces can transmit. Every force at point k is a non-negative combination of *generators*
///
///     f_k = M g sum_e lambda_ke v_ke,    v_ke = n + mu (cos(e pi/4) t1 + sin(e pi/4) t2),    e = 0..7
///
/// n: normal, t1 and t2: tangents, mu: friction coefficient. lambda is in units of the robot's weight M g. Since
/// n . v = 1, the normal force of a surface is M g times the sum of its lambda. A bar's six generators are its axes in
/// both directions, with 0 <= lambda <= max_component.
///
/// Immutable and thread-safe. Source: contact wrench cone with linearised friction.
class StanceForces {
 public:
  explicit StanceForces(const std::vector<TouchedSurface>& surfaces,
                        FrictionPyramid pyramid = FrictionPyramid::kInscribed);

  /// A point where a force acts.
  struct Point {
    int surface;                 ///< index into the surfaces
    int link;                    ///< index into RobotModel::links()
    Eigen::Vector3d position_W;  ///< m, in the world
  };
  const std::vector<Point>& points() const { return points_; }
  /// Mean of all points, m, in the world: the origin of moments.
  const Eigen::Vector3d& origin_W() const { return origin_W_; }

  /// Upper bound of the distance of the robot's centre of mass from origin_W(), m: the largest of the surfaces; 0 if it
  /// is not known.
  double com_reach_m() const { return com_reach_m_; }

  int num_generators() const { return static_cast<int>(directions_.cols()); }
  /// Generators v, 3 x L, in the world.
  const Eigen::Matrix3Xd& directions() const { return directions_; }
  /// Moments (p - origin) x v, 3 x L, m.
  const Eigen::Matrix3Xd& moments() const { return moments_; }
  /// Upper bounds of lambda, L; infinite for generators of friction cones.
  const Eigen::VectorXd& upper() const { return upper_; }
  /// Returns the index into points() of a generator. The generators of a point follow each other.
  int point_of(int generator) const { return generator_points_[static_cast<size_t>(generator)]; }
  /// Returns the index into the surfaces of a generator.
  int surface_of(int generator) const { return points_[static_cast<size_t>(point_of(generator))].surface; }

  /// Bound of a surface's normal force.
  struct NormalBound {
    int surface;
    double maximum;  ///< largest force in units of the weight, > 0
  };
  const std::vector<NormalBound>& bounds() const { return bounds_; }

 private:
  Eigen::Vector3d origin_W_ = Eigen::Vector3d::Zero();
  double com_reach_m_ = 0.0;
  std::vector<Point> points_;
  std::vector<int> generator_points_;
  Eigen::Matrix3Xd directions_, moments_;
  Eigen::VectorXd upper_;
  std::vector<NormalBound> bounds_;
};

}  // namespace legopt
