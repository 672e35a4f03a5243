#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "legopt/collision/mesh.h"

namespace legopt {

/// Vertical rays through a scene's triangles: where is ground, what is above it. Immutable; any number of threads.
class Terrain {
 public:
  /// `bin_m`: edge of the squares in plan by which triangles are found. It is doubled until squares and the triangles
  /// in them take no more than some 200 MB; results do not depend on it. Coordinates must be finite, and below 1e9 m.
  explicit Terrain(TriangleMesh mesh, double bin_m = 0.25);

  /// Where a vertical ray meets a surface.
  struct Hit {
    double z_m = 0.0;   ///< height
    int triangle = -1;  ///< index into mesh(); -1: none
  };
  /// Surfaces that look up (n_z > 0) above (x, y) with heights in [low, high], highest first. Appends to a cleared
  /// list.
  void Ground(double x, double y, double low_m, double high_m, std::vector<Hit>& hits) const;
  /// Highest such surface; triangle -1 when there is none.
  Hit Highest(double x, double y, double low_m, double high_m) const;
  /// Height of the lowest surface of any orientation above z + 1 mm; +infinity under the open sky.
  double NextAbove(double x, double y, double z_m) const;

  /// Unit, by the triangle's winding; zero for a triangle without area.
  const Eigen::Vector3d& normal(int triangle) const { return normals_[static_cast<size_t>(triangle)]; }
  double area_m2(int triangle) const { return areas_m2_[static_cast<size_t>(triangle)]; }  ///< of a triangle
  const TriangleMesh& mesh() const { return mesh_; }                                       ///< as given
  const Eigen::AlignedBox3d& bounds() const { return bounds_; }                            ///< of all vertices

 private:
  /// Height of the triangle above (x, y), or false when the point is outside of it.
  bool HeightAt(int triangle, double x, double y, double& z) const;
  const std::vector<int>* Bin(double x, double y) const;
  void ChooseBins();
  void FillBins();

  TriangleMesh mesh_;
  double bin_m_;
  Eigen::AlignedBox3d bounds_;
  std::vector<Eigen::AlignedBox2d> boxes_;  ///< of the triangles in plan, while bins are filled
  int bins_x_ = 0, bins_y_ = 0;
  std::vector<std::vector<int>> bins_;
  std::vector<Eigen::Vector3d> normals_;
  std::vector<double> areas_m2_;
};

}  // namespace legopt
