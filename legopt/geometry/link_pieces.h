#pragma once

#include <map>
#include <vector>

#include "legopt/geometry/convex_decomposition.h"
#include "legopt/geometry/convex_shape.h"
#include "legopt/robot/robot_model.h"

namespace legopt {

/// Convex shapes that together cover the geometry of a link, in the link's frame: primitives unchanged, meshes
/// decomposed. Computed on demand and cached. Not thread-safe.
class LinkPieces {
 public:
  /// `robot` must outlive this object.
  LinkPieces(const RobotModel& robot, const DecompositionLimits& limits) : robot_(robot), limits_(limits) {}

  /// Returns the pieces with meshes decomposed as a whole (DecomposeApproximately). Throws InputError.
  const std::vector<ConvexShape>& Pieces(int link);
  /// Returns the pieces with meshes decomposed body by body (DecomposeBodies). Throws InputError.
  const std::vector<ConvexShape>& Bodies(int link);

 private:
  const RobotModel& robot_;
  DecompositionLimits limits_;
  std::map<int, std::vector<ConvexShape>> pieces_, bodies_;
};

}  // namespace legopt
