#pragma once

#include <optional>
#include <vector>

#include "legopt/collision/mesh.h"

namespace legopt {

/// A body between a plane on top and a plane below, with vertical walls; in plan any polygon, holes included.
struct VerticalPrism {
  /// z = c0 + c1 x + c2 y
  Eigen::Vector3d top;
  /// Of the plane below, likewise.
  Eigen::Vector3d bottom;
  std::vector<Eigen::Vector3d> vertices;      ///< of the top surface
  std::vector<std::array<int, 3>> triangles;  ///< of the top surface, counter-clockwise in plan
};

/// The component as a vertical prism, or nothing when it is not one to within `tolerance_m` [m].
/// Slivers and a few open edges do not matter: only the two surfaces are used.
std::optional<VerticalPrism> RecogniseVerticalPrism(const TriangleMesh& component, double tolerance_m = 1e-4);

/// Cuts prisms into convex pieces, each given by its corners on the two planes.
///
/// Prisms with the same two planes are joined first, wherever their top triangles share edges. Neighbouring triangles
/// are merged while the merged polygon is convex (dents of up to `dent_m` are filled: sideways only, never above the
/// surface).
std::vector<std::vector<Eigen::Vector3d>> CutIntoConvexPrisms(const std::vector<VerticalPrism>& prisms,
                                                              double dent_m = 2e-4);

}  // namespace legopt
