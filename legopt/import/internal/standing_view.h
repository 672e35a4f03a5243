#pragma once

#include <Eigen/Core>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/geometry/internal/mesh.h"

namespace legopt {

/// Contents of a picture of a standing robot, in the world frame (m, z up).
struct StandingView {
  std::vector<TriangleMesh> links;  ///< collision geometry, one per link that has any
  std::vector<std::vector<Eigen::Vector3d>>
      contacts;                                   ///< corners of each sole, in order; one point for a point contact
  Eigen::Vector3d com = Eigen::Vector3d::Zero();  ///< centre of mass
};

/// Places the robot of a dataset in configuration `x` (n + 7). Meshes of more than 1,000 triangles are replaced by
/// their convex hulls, which are drawn faster.
StandingView ViewOf(const Dataset& dataset, const Eigen::VectorXd& x);

}  // namespace legopt
