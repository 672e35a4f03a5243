#pragma once

#include <Eigen/Geometry>
#include <random>
#include <utility>
#include <vector>

#include "legopt/geometry/internal/convex_shape.h"
#include "legopt/geometry/internal/mesh.h"

namespace legopt::test {

inline constexpr double kBeyondAllDistances = 1e9;  ///< a distance beyond all others

/// A convex shape placed in the world, with the arrays that its support set refers to.
class PlacedShape {
 public:
  PlacedShape(ConvexShape shape, const Eigen::Isometry3d& pose) : shape_(std::move(shape)) {
    const PointArena::Range range = local_.Add(shape_.points());
    world_.ResizeLike(local_);
    PlaceSupportSet(shape_, pose, set_);
    Eigen::Vector3d low;
    Eigen::Vector3d high;
    if (range.count > 0) world_.Transform(local_, range, pose, low, high);
    world_.View(range, set_);
    for (const Eigen::Vector3d& p : shape_.points()) points_.push_back(pose * p);
  }
  PlacedShape(const PlacedShape&) = delete;
  PlacedShape& operator=(const PlacedShape&) = delete;

  const SupportSet& set() const { return set_; }
  const std::vector<Eigen::Vector3d>& points() const { return points_; }

 private:
  ConvexShape shape_;
  PointArena local_, world_;
  SupportSet set_;
  std::vector<Eigen::Vector3d> points_;
};

inline ShapeSpec Spec(ShapeSpec::Kind kind, const Eigen::Vector3d& size,
                      const Eigen::Isometry3d& pose = Eigen::Isometry3d::Identity()) {
  ShapeSpec spec;
  spec.kind = kind;
  spec.size = size;
  spec.pose = pose;
  return spec;
}

inline ConvexShape Box(double x, double y, double z) {
  return ConvexShape::FromPrimitive(Spec(ShapeSpec::Kind::kBox, {x, y, z}));
}
inline ConvexShape Sphere(double radius) {
  return ConvexShape::FromPrimitive(Spec(ShapeSpec::Kind::kSphere, {radius, 0.0, 0.0}));
}
inline ConvexShape Capsule(double radius, double length) {
  return ConvexShape::FromPrimitive(Spec(ShapeSpec::Kind::kCapsule, {radius, 0.0, length}));
}
inline ConvexShape Cylinder(double radius, double length) {
  return ConvexShape::FromPrimitive(Spec(ShapeSpec::Kind::kCylinder, {radius, 0.0, length}));
}
inline ConvexShape Hull(const std::vector<Eigen::Vector3d>& points) {
  return ConvexShape::FromHull(ComputeHull(points));
}

inline Eigen::Isometry3d At(double x, double y, double z) { return Eigen::Isometry3d(Eigen::Translation3d(x, y, z)); }

/// Uniform random numbers, vectors and poses from a seeded generator.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed) {}
  double Number(double low, double high) {
    return low + (high - low) * static_cast<double>(random_() >> 11) * 0x1.0p-53;
  }
  Eigen::Vector3d Vector(double half_width) {
    const double x = Number(-half_width, half_width);
    const double y = Number(-half_width, half_width);
    return {x, y, Number(-half_width, half_width)};
  }
  Eigen::Isometry3d Pose(double half_width) {
    const Eigen::Vector3d p = Vector(half_width);
    const Eigen::Vector3d v = Vector(1.0);
    const Eigen::Quaterniond q(Number(-1.0, 1.0), v.x(), v.y(), v.z());
    return Eigen::Isometry3d(Eigen::Translation3d(p)) * q.normalized();
  }
  /// Returns the hull of random points in a box of half widths `size`.
  ConvexHull RandomHull(int points, const Eigen::Vector3d& size) {
    std::vector<Eigen::Vector3d> cloud;
    for (int i = 0; i < points; ++i) cloud.push_back(size.cwiseProduct(Vector(1.0)));
    return ComputeHull(cloud);
  }

 private:
  std::mt19937_64 random_;
};

}  // namespace legopt::test
