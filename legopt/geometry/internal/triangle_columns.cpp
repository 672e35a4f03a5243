#include "legopt/geometry/internal/triangle_columns.h"

#include <algorithm>
#include <cmath>

namespace legopt {
namespace {

/// Triangles narrower than this in plan, relative to their longest edge, count as parallel to the z axis.
constexpr double kParallel = 1e-9;
/// A point this far outside an edge still counts as inside, m, so that no line passes between neighbouring triangles.
constexpr double kSeam_m = 1e-9;

}  // namespace

void TriangleColumns::Add(const TriangleMesh& mesh, int index, const Eigen::Isometry3d& pose) {
  std::array<Eigen::Vector3d, 3> corners;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const int vertex = mesh.triangles[static_cast<std::size_t>(index)][k];
    corners[k] = pose * mesh.vertices[static_cast<std::size_t>(vertex)];
  }
  const Eigen::Vector3d normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  const double longest =
      std::max({(corners[1] - corners[0]).norm(), (corners[2] - corners[1]).norm(), (corners[0] - corners[2]).norm()});
  if (!(std::abs(normal.z()) > kParallel * longest * longest)) return;
  Column column;
  column.corners = corners;
  column.slope = -normal.head<2>() / normal.z();
  column.height = corners[0].z() - column.slope.dot(corners[0].head<2>());
  const double side = normal.z() > 0 ? 1.0 : -1.0;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d& from = corners[static_cast<std::size_t>(k)];
    const Eigen::Vector3d& to = corners[static_cast<std::size_t>((k + 1) % 3)];
    const Eigen::Vector2d edge = (to - from).head<2>();
    const Eigen::Vector2d inward = side * Eigen::Vector2d(-edge.y(), edge.x()) / edge.norm();
    column.edges.row(k) << inward.transpose(), kSeam_m - inward.dot(from.head<2>());
    column.box.extend(from.head<2>().eval());
  }
  triangles_.push_back(column);
}

std::vector<Eigen::Vector3d> TriangleColumns::Corners() const {
  std::vector<Eigen::Vector3d> all;
  all.reserve(3 * triangles_.size());
  for (const Column& column : triangles_) all.insert(all.end(), column.corners.begin(), column.corners.end());
  return all;
}

template <class Visit>
void TriangleColumns::ForEachHeight(const Eigen::Vector2d& p, Visit visit) const {
  for (const Column& column : triangles_) {
    if (column.box.squaredExteriorDistance(p) > kSeam_m * kSeam_m) continue;
    if ((column.edges * p.homogeneous()).minCoeff() >= 0.0) visit(column.height + column.slope.dot(p));
  }
}

double TriangleColumns::Lowest(const Eigen::Vector2d& p) const {
  double lowest = kNone;
  ForEachHeight(p, [&](double height) { lowest = std::min(lowest, height); });
  return lowest;
}

double TriangleColumns::HighestBelow(const Eigen::Vector2d& p, double ceiling) const {
  double highest = -kNone;
  ForEachHeight(p, [&](double height) {
    if (height <= ceiling) highest = std::max(highest, height);
  });
  return highest;
}

}  // namespace legopt
