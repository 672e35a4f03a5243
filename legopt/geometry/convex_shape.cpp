#include "legopt/geometry/convex_shape.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "legopt/geometry/mesh.h"
#include "legopt/types/input_error.h"

namespace legopt {
namespace {

double BoxDistance(const Eigen::Vector3d& half, const Eigen::Vector3d& p) { return (p.cwiseAbs() - half).maxCoeff(); }

double CylinderDistance(double radius, double half_length, const Eigen::Vector3d& p) {
  return std::max(p.head<2>().norm() - radius, std::abs(p.z()) - half_length);
}

double CapsuleDistance(double radius, double half_length, const Eigen::Vector3d& p) {
  const double z = std::clamp(p.z(), -half_length, half_length);
  return (p - Eigen::Vector3d(0.0, 0.0, z)).norm() - radius;
}

ConvexShape::Kind KindOf(ShapeSpec::Kind kind) {
  switch (kind) {
    case ShapeSpec::Kind::kBox:
      return ConvexShape::Kind::kBox;
    case ShapeSpec::Kind::kSphere:
      return ConvexShape::Kind::kSphere;
    case ShapeSpec::Kind::kCylinder:
      return ConvexShape::Kind::kCylinder;
    case ShapeSpec::Kind::kCapsule:
      return ConvexShape::Kind::kCapsule;
    case ShapeSpec::Kind::kMesh:
      break;
  }
  return ConvexShape::Kind::kHull;
}

}  // namespace

ConvexShape ConvexShape::FromHull(ConvexHull hull) {
  ConvexShape shape;
  shape.points_ = hull.vertices;
  shape.hull_ = std::move(hull);
  for (const Eigen::Vector3d& p : shape.points_) shape.centre_ += p / static_cast<double>(shape.points_.size());
  shape.FinishBounds();
  return shape;
}

ConvexShape ConvexShape::FromPrimitive(const ShapeSpec& spec) {
  const TriangleMesh check = Tessellate(spec);  // validates sizes and pose
  ConvexShape shape;
  shape.kind_ = KindOf(spec.kind);
  shape.pose_ = spec.pose;
  shape.size_ = spec.size;
  shape.centre_ = spec.pose.translation();
  const Eigen::Vector3d half_axis = 0.5 * spec.size.z() * spec.pose.linear().col(2);
  switch (shape.kind_) {
    case Kind::kBox:
    case Kind::kHull:
      shape.points_ = check.vertices;
      break;
    case Kind::kSphere:
      shape.points_ = {shape.centre_};
      shape.radius_ = spec.size.x();
      break;
    case Kind::kCapsule:
      shape.points_ = {shape.centre_ - half_axis, shape.centre_ + half_axis};
      shape.radius_ = spec.size.x();
      break;
    case Kind::kCylinder:
      break;
  }
  shape.FinishBounds();
  return shape;
}

void ConvexShape::FinishBounds() {
  SupportSet set;
  PlaceSupportSet(*this, Eigen::Isometry3d::Identity(), set);
  PointArena arena;
  if (!points_.empty()) arena.View(arena.Add(points_), set);
  bounds_ = SupportBounds(set);
  for (const Eigen::Vector3d& p : points_) {
    bounding_radius_ = std::max(bounding_radius_, (p - centre_).norm() + radius_);
  }
  if (points_.empty()) bounding_radius_ = std::hypot(size_.x(), 0.5 * size_.z());
}

double ConvexShape::BoundaryDistance(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d p = pose_.inverse(Eigen::Isometry) * point;
  switch (kind_) {
    case Kind::kHull:
      return hull_.PlaneDistance(point);
    case Kind::kBox:
      return BoxDistance(0.5 * size_, p);
    case Kind::kSphere:
      return p.norm() - size_.x();
    case Kind::kCapsule:
      return CapsuleDistance(size_.x(), 0.5 * size_.z(), p);
    case Kind::kCylinder:
      return CylinderDistance(size_.x(), 0.5 * size_.z(), p);
  }
  return std::numeric_limits<double>::infinity();
}

PointArena::Range PointArena::Add(const std::vector<Eigen::Vector3d>& points) {
  Range range{static_cast<int>(x_.size()), 0};
  for (const Eigen::Vector3d& p : points) {
    x_.push_back(p.x());
    y_.push_back(p.y());
    z_.push_back(p.z());
  }
  while (!points.empty() && x_.size() % SupportSet::kLanes != 0) {
    x_.push_back(points.back().x());
    y_.push_back(points.back().y());
    z_.push_back(points.back().z());
  }
  range.count = static_cast<int>(x_.size()) - range.begin;
  return range;
}

void PointArena::ResizeLike(const PointArena& other) {
  x_.resize(other.x_.size());
  y_.resize(other.y_.size());
  z_.resize(other.z_.size());
}

void PointArena::Transform(const PointArena& other, Range range, const Eigen::Isometry3d& pose, Eigen::Vector3d& lower,
                           Eigen::Vector3d& upper) {
  using Column = Eigen::Array<double, SupportSet::kLanes, 1>;
  const Eigen::Matrix3d r = pose.linear();
  const Eigen::Vector3d t = pose.translation();
  Column low[3];
  Column high[3];
  for (int axis = 0; axis < 3; ++axis) {
    low[axis].setConstant(std::numeric_limits<double>::infinity());
    high[axis].setConstant(-std::numeric_limits<double>::infinity());
  }
  double* const out[3] = {x_.data(), y_.data(), z_.data()};
  for (int i = range.begin; i < range.begin + range.count; i += SupportSet::kLanes) {
    const Column x = Eigen::Map<const Column>(other.x_.data() + i);
    const Column y = Eigen::Map<const Column>(other.y_.data() + i);
    const Column z = Eigen::Map<const Column>(other.z_.data() + i);
    for (int axis = 0; axis < 3; ++axis) {
      const Column value = r(axis, 0) * x + r(axis, 1) * y + r(axis, 2) * z + t[axis];
      Eigen::Map<Column>(out[axis] + i) = value;
      low[axis] = low[axis].min(value);
      high[axis] = high[axis].max(value);
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    lower[axis] = low[axis].minCoeff();
    upper[axis] = high[axis].maxCoeff();
  }
}

void PointArena::View(Range range, SupportSet& set) const {
  set.x = x_.data() + range.begin;
  set.y = y_.data() + range.begin;
  set.z = z_.data() + range.begin;
  set.count = range.count;
}

void PlaceSupportSet(const ConvexShape& shape, const Eigen::Isometry3d& pose, SupportSet& set) {
  set.radius = shape.radius();
  set.centre = pose * shape.centre();
  if (shape.kind() != ConvexShape::Kind::kCylinder) return;
  set.axis = pose.linear() * shape.pose().linear().col(2);
  set.cylinder_radius = shape.size().x();
  set.half_length = 0.5 * shape.size().z();
}

Eigen::AlignedBox3d SupportBounds(const SupportSet& set) {
  Eigen::Vector3d lower;
  Eigen::Vector3d upper;
  for (int axis = 0; axis < 3; ++axis) {
    upper[axis] = set.Farthest(Eigen::Vector3d::Unit(axis))[axis] + set.radius;
    lower[axis] = set.Farthest(-Eigen::Vector3d::Unit(axis))[axis] - set.radius;
  }
  return {lower, upper};
}

}  // namespace legopt
