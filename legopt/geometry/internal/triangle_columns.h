#pragma once

#include <Eigen/Geometry>
#include <array>
#include <limits>
#include <vector>

#include "legopt/geometry/internal/mesh.h"

namespace legopt {

/// Triangles in a frame, searched along lines parallel to its z axis: the underside of a foot, or the surface below it.
/// Lengths in metres. Const members are thread-safe.
class TriangleColumns {
 public:
  /// Height where a line meets no triangle.
  static constexpr double kNone = std::numeric_limits<double>::infinity();

  /// Removes all triangles.
  void Clear() { triangles_.clear(); }
  /// Adds triangle `index` of a mesh, moved by `pose` into the frame. Triangles parallel to the z axis are omitted:
  /// their edges belong to other triangles of a closed surface.
  void Add(const TriangleMesh& mesh, int index, const Eigen::Isometry3d& pose);

  /// Returns the corners of all triangles in the frame, three per triangle.
  std::vector<Eigen::Vector3d> Corners() const;
  /// Returns the height of the lowest triangle over `p`, or kNone.
  double Lowest(const Eigen::Vector2d& p) const;
  /// Returns the height of the highest triangle over `p` that is not above `ceiling`, or -kNone.
  double HighestBelow(const Eigen::Vector2d& p, double ceiling) const;

 private:
  /// z = height + slope . p over the triangle; `p` is inside if edges[k] . (p.x, p.y, 1) >= 0 for all k.
  struct Column {
    Eigen::Matrix3d edges = Eigen::Matrix3d::Zero();
    Eigen::Vector2d slope = Eigen::Vector2d::Zero();
    double height = 0.0;
    Eigen::AlignedBox2d box;
    std::array<Eigen::Vector3d, 3> corners;
  };
  template <class Visit>
  void ForEachHeight(const Eigen::Vector2d& p, Visit visit) const;

  std::vector<Column> triangles_;
};

}  // namespace legopt
