#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "legopt/collision/hull.h"
#include "legopt/collision/support_set.h"
#include "legopt/robot/robot_model.h"

namespace legopt {

/// One convex solid in the frame of its owner (a link, or the world): a polytope or a primitive.
class ConvexShape {
 public:
  /// What a shape is.
  enum class Kind {
    kHull,     ///< of points
    kBox,      ///< as in ShapeSpec
    kSphere,   ///< as in ShapeSpec
    kCapsule,  ///< as in ShapeSpec
    kCylinder  ///< as in ShapeSpec
  };

  /// The polytope; flat ones are legal.
  static ConvexShape FromHull(ConvexHull hull);
  /// Not for meshes. Throws InputError for sizes that are not positive and finite.
  static ConvexShape FromPrimitive(const ShapeSpec& spec);

  Kind kind() const { return kind_; }  ///< what it is
  /// Primitives: frame and size as in ShapeSpec. Hulls: identity, zero.
  const Eigen::Isometry3d& pose() const { return pose_; }
  /// As in ShapeSpec, m; zero for hulls.
  const Eigen::Vector3d& size() const { return size_; }
  /// Points of the core: hull vertices, box corners, capsule ends, sphere centre; empty for a cylinder.
  const std::vector<Eigen::Vector3d>& points() const { return points_; }
  /// Rounding of the core: sphere, capsule. 0 otherwise.
  double radius() const { return radius_; }
  /// A point inside.
  const Eigen::Vector3d& centre() const { return centre_; }
  /// Radius of a ball about centre() that holds the shape.
  double bounding_radius() const { return bounding_radius_; }
  const Eigen::AlignedBox3d& bounds() const { return bounds_; }  ///< axis-aligned, in the owner's frame
  const ConvexHull& hull() const { return hull_; }               ///< of kHull; empty for primitives

  /// Distance to the boundary: < 0 inside (exact), > 0 outside (a lower bound for hulls and boxes).
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

/// Coordinates of many shapes' core points as three arrays, each shape padded to whole lanes (SupportSet).
class PointArena {
 public:
  /// Where the points of one shape are.
  struct Range {
    int begin = 0;  ///< a multiple of SupportSet::kLanes
    int count = 0;  ///< padding included; a multiple of SupportSet::kLanes
  };

  /// Appends the points of one shape; the last one is repeated as padding. Earlier views are void.
  Range Add(const std::vector<Eigen::Vector3d>& points);
  /// Room for the same ranges, values undefined.
  void ResizeLike(const PointArena& other);
  /// this[range] = rotation * other[range] + translation; `lower` and `upper` receive the bounds of the result.
  void Transform(const PointArena& other, Range range, const Eigen::Isometry3d& pose, Eigen::Vector3d& lower,
                 Eigen::Vector3d& upper);
  /// Points the arrays of a support set at a range.
  void View(Range range, SupportSet& set) const;

 private:
  std::vector<double> x_, y_, z_;
};

/// Fills everything of a support set but its arrays, for a shape whose owner stands at `pose`.
void PlaceSupportSet(const ConvexShape& shape, const Eigen::Isometry3d& pose, SupportSet& set);

/// Bounds of a placed support set in world axes.
Eigen::AlignedBox3d SupportBounds(const SupportSet& set);

}  // namespace legopt
