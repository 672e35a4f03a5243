#pragma once

#include <map>
#include <vector>

#include "legopt/collision/convex_decomposition.h"
#include "legopt/collision/convex_shape.h"
#include "legopt/robot/robot_model.h"

namespace legopt {

/// Convex shapes that together cover the geometry of a link, in the link's frame: primitives as they are, meshes
/// decomposed. Each is computed when it is first asked for, and kept. One thread.
class LinkPieces {
 public:
  /// `robot` must outlive this object.
  LinkPieces(const RobotModel& robot, const DecompositionLimits& limits) : robot_(robot), limits_(limits) {}

  /// Meshes as wholes (DecomposeApproximately). Throws InputError.
  const std::vector<ConvexShape>& Pieces(int link);
  /// Meshes body by body (DecomposeBodies). Throws InputError.
  const std::vector<ConvexShape>& Bodies(int link);

 private:
  const RobotModel& robot_;
  DecompositionLimits limits_;
  std::map<int, std::vector<ConvexShape>> pieces_, bodies_;
};

}  // namespace legopt
