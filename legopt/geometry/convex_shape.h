#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "legopt/geometry/hull.h"
#include "legopt/geometry/support_set.h"
#include "legopt/robot/robot_model.h"

namespace legopt {

/// One convex solid in the frame of its owner (a link, or the world): a polytope or a primitive.
class ConvexShape {
 public:
  /// Type of a shape.
  enum class Kind {
    kHull,  ///< convex hull of points
    kBox,
    kSphere,
    kCapsule,
    kCylinder
  };

  /// Returns the polytope of a hull, which may be flat.
  static ConvexShape FromHull(ConvexHull hull);
  /// Returns a primitive; meshes are not allowed. Throws InputError for sizes that are not positive and finite.
  static ConvexShape FromPrimitive(const ShapeSpec& spec);

  Kind kind() const { return kind_; }
  /// Frame of a primitive, see ShapeSpec; identity for hulls.
  const Eigen::Isometry3d& pose() const { return pose_; }
  /// Size of a primitive, see ShapeSpec, m; zero for hulls.
  const Eigen::Vector3d& size() const { return size_; }
  /// Points of the core: hull vertices, box corners, capsule ends, sphere centre; empty for a cylinder.
  const std::vector<Eigen::Vector3d>& points() const { return points_; }
  /// Rounding radius of the core: sphere, capsule. 0 for other shapes.
  double radius() const { return radius_; }
  /// A point inside.
  const Eigen::Vector3d& centre() const { return centre_; }
  /// Radius of a ball about centre() that contains the shape.
  double bounding_radius() const { return bounding_radius_; }
  const Eigen::AlignedBox3d& bounds() const { return bounds_; }  ///< axis-aligned, in the owner's frame
  const ConvexHull& hull() const { return hull_; }               ///< empty for primitives

  /// Returns the distance from the boundary: < 0 inside (exact), > 0 outside (a lower bound for hulls and boxes).
  double BoundaryDistance(const Eigen::Vector3d& point) const;

 private:
  void FinishBounds();

  Kind kind_ = Kind::kHull;
  Eigen::Isometry3d pose_ = Eigen::Isometry3d::Identity();
  Eigen::Vector3d size_ = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> points_;
  double radius_ = 0.0;
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
  double bounding_radius_ = 0.0;
  Eigen::AlignedBox3d bounds_;
  ConvexHull hull_;
};

/// Coordinates of many shapes' core points in three arrays, each shape padded to whole lanes (SupportSet).
class PointArena {
 public:
  /// Index range of one shape's points.
  struct Range {
    int begin = 0;  ///< a multiple of SupportSet::kLanes
    int count = 0;  ///< including padding; a multiple of SupportSet::kLanes
  };

  /// Appends the points of one shape; the last one is repeated as padding. Invalidates earlier views.
  Range Add(const std::vector<Eigen::Vector3d>& points);
  /// Allocates the ranges of `other` with undefined values.
  void ResizeLike(const PointArena& other);
  /// Computes this[range] = rotation * other[range] + translation; `lower` and `upper` receive the bounds of the
  /// result.
  void Transform(const PointArena& other, Range range, const Eigen::Isometry3d& pose, Eigen::Vector3d& lower,
                 Eigen::Vector3d& upper);
  /// Sets the arrays of a support set to a range.
  void View(Range range, SupportSet& set) const;

 private:
  std::vector<double> x_, y_, z_;
};

/// Sets all members of a support set except its arrays, for a shape whose owner is at `pose`.
void PlaceSupportSet(const ConvexShape& shape, const Eigen::Isometry3d& pose, SupportSet& set);

/// Returns the bounds of a transformed support set in world axes.
Eigen::AlignedBox3d SupportBounds(const SupportSet& set);

}  // namespace legopt
