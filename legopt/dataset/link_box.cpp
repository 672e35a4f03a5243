#include "legopt/dataset/link_box.h"

#include <cmath>

#include "legopt/geometry/mesh.h"

namespace legopt {
namespace {

/// Returns the half extents, along the owner's axes, of a primitive centred at its pose.
Eigen::Vector3d HalfExtents(const ShapeSpec& shape) {
  const Eigen::Matrix3d R = shape.pose.linear();
  const double radius = shape.size.x();
  const Eigen::Vector3d along_axis = R.col(2).cwiseAbs() * (0.5 * shape.size.z());
  switch (shape.kind) {
    case ShapeSpec::Kind::kBox:
      return R.cwiseAbs() * (0.5 * shape.size);
    case ShapeSpec::Kind::kSphere:
      return Eigen::Vector3d::Constant(radius);
    case ShapeSpec::Kind::kCapsule:
      return along_axis + Eigen::Vector3d::Constant(radius);
    case ShapeSpec::Kind::kCylinder:
      // A disc with normal a has half extent r sqrt(1 - a_i^2) along axis i.
      return along_axis + radius * (1 - R.col(2).array().square()).max(0).sqrt().matrix();
    case ShapeSpec::Kind::kMesh:
      break;
  }
  return Eigen::Vector3d::Zero();
}

}  // namespace

Eigen::AlignedBox3d LinkBox(const Link& link, const ReadGuard& guard) {
  Eigen::AlignedBox3d box;
  for (const ShapeSpec& shape : link.collision) {
    if (shape.kind == ShapeSpec::Kind::kMesh) {
      for (const Eigen::Vector3d& vertex : LoadMesh(shape.mesh_file, shape.scale, guard).vertices) {
        box.extend(shape.pose * vertex);
      }
    } else {
      const Eigen::Vector3d half = HalfExtents(shape);
      box.extend(Eigen::AlignedBox3d(shape.pose.translation() - half, shape.pose.translation() + half));
    }
  }
  return box;
}

}  // namespace legopt
