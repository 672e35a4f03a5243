#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "legopt/geometry/internal/mesh.h"

namespace legopt {

/// Vertical ray casts against a scene's triangles: height of the ground, and free space above it. Immutable and
/// thread-safe.
class Terrain {
 public:
  /// `bin_m`: edge of the square bins in plan for the search of triangles. It is doubled until bins and triangles take
  /// at most about 200 MB; results do not depend on it. Coordinates must be finite and below 1e9 m.
  explicit Terrain(TriangleMesh mesh, double bin_m = 0.25);

  /// Intersection of a vertical ray with a surface.
  struct Hit {
    double z_m = 0.0;   ///< height
    int triangle = -1;  ///< index into mesh(); -1: none
  };
  /// Finds upward surfaces (n_z > 0) above (x, y) with heights in [low, high], highest first. `hits` is cleared first.
  void Ground(double x, double y, double low_m, double high_m, std::vector<Hit>& hits) const;
  /// Returns the highest upward surface in [low, high]; triangle -1 if there is none.
  Hit Highest(double x, double y, double low_m, double high_m) const;
  /// Returns the height of the lowest surface of any orientation above z + 1 mm; +infinity if there is none.
  double CeilingHeight(double x, double y, double z_m) const;

  /// Returns the unit normal of a triangle by its winding; zero for a triangle without area.
  const Eigen::Vector3d& normal(int triangle) const { return normals_[static_cast<size_t>(triangle)]; }
  double area_m2(int triangle) const {
    return areas_m2_[static_cast<size_t>(triangle)];
  }  ///< returns the area of a
     ///< triangle
  const TriangleMesh& mesh() const { return mesh_; }
  const Eigen::AlignedBox3d& bounds() const {
    return bounds_;
  }  ///< bounding box of all
     ///< vertices

 private:
  /// Computes the height of the triangle above (x, y). Returns false if the point is outside.
  bool HeightAt(int triangle, double x, double y, double& z) const;
  const std::vector<int>* Bin(double x, double y) const;
  void ChooseBins();
  void FillBins();

  TriangleMesh mesh_;
  double bin_m_;
  Eigen::AlignedBox3d bounds_;
  std::vector<Eigen::AlignedBox2d> boxes_;  ///< boxes of the triangles in plan, while bins are filled
  int bins_x_ = 0, bins_y_ = 0;
  std::vector<std::vector<int>> bins_;
  std::vector<Eigen::Vector3d> normals_;
  std::vector<double> areas_m2_;
};

}  // namespace legopt
