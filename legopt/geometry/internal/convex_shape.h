#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <span>
#include <vector>

#include "legopt/geometry/internal/signed_distance.h"
#include "legopt/robot/robot_model.h"

namespace legopt {

/// Half space n . p + offset <= 0.
struct HalfSpace {
  Eigen::Vector3d normal;  ///< outward unit vector
  double offset = 0.0;     ///< m
};

/// Convex hull of points. The hull of a flat set has vertices, but no facets and no volume.
struct ConvexHull {
  std::vector<Eigen::Vector3d> vertices;      ///< a subset of the points, in their order
  std::vector<HalfSpace> facets;              ///< half spaces whose intersection is the hull; none for flat hulls
  std::vector<std::array<int, 3>> triangles;  ///< indices into `vertices`, outward winding; none for flat hulls
  double volume_m3 = 0.0;                     ///< 0 for flat hulls

  bool flat() const { return facets.empty(); }  ///< true if the points lie in a plane, on a line or in a point
  /// Returns the largest n . p + offset: < 0 inside, minus the distance from the boundary; > 0 outside, a lower bound
  /// of the distance.
  double PlaneDistance(const Eigen::Vector3d& point) const;
};

/// Computes a convex hull with Qhull (reentrant, no global state, no output). Vertices are a subset of `points`, in
/// their order, so that equal input gives equal output. Sets thinner than about 1e-9 of their size give flat hulls.
/// Aborts if `points` is empty or not finite.
ConvexHull ComputeHull(std::span<const Eigen::Vector3d> points);

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
