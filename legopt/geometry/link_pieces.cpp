#include "legopt/geometry/link_pieces.h"

#include <utility>

namespace legopt {
namespace {

using Decomposition = std::vector<ConvexHull> (*)(const TriangleMesh&, const DecompositionLimits&);

std::vector<ConvexShape> Decompose(const RobotModel& robot, int link, Decomposition decompose,
                                   const DecompositionLimits& limits) {
  std::vector<ConvexShape> shapes;
  for (const ShapeSpec& spec : robot.links()[static_cast<size_t>(link)].collision) {
    if (spec.kind != ShapeSpec::Kind::kMesh) {
      shapes.push_back(ConvexShape::FromPrimitive(spec));
      continue;
    }
    for (ConvexHull& hull : decompose(Tessellate(spec, robot.read_guard()), limits)) {
      shapes.push_back(ConvexShape::FromHull(std::move(hull)));
    }
  }
  return shapes;
}

}  // namespace

const std::vector<ConvexShape>& LinkPieces::Pieces(int link) {
  const auto [it, inserted] = pieces_.try_emplace(link);
  if (inserted) it->second = Decompose(robot_, link, DecomposeApproximately, limits_);
  return it->second;
}

const std::vector<ConvexShape>& LinkPieces::Bodies(int link) {
  const auto [it, inserted] = bodies_.try_emplace(link);
  if (inserted) it->second = Decompose(robot_, link, DecomposeBodies, limits_);
  return it->second;
}

}  // namespace legopt
