#include <gtest/gtest.h>

#include "legopt/worldgen/internal/collapse.h"
#include "legopt/worldgen/internal/scenario.h"

namespace legopt::worldgen {
namespace {

/// Returns a ground of 10 x 10 m with a table of 2 x 2 m, whose top is at 1 m and whose underside is at 0.8 m.
TriangleMesh GroundAndTable() {
  Building building;
  BuildingParts parts(&building);
  parts.Box("ground", {-5, -5, -1}, {5, 5, 0}, Material::kGround, 0.0);
  parts.Box("table", {-1, -1, 0.8}, {1, 1, 1}, Material::kConcrete, 0.0);
  building.plan = {Eigen::Vector2d(-5, -5), Eigen::Vector2d(5, 5)};
  const std::vector<Cell> cells = {WholeCell(building.members[0], 0), WholeCell(building.members[1], 1)};
  Snapshot snapshot;
  snapshot.cells.resize(2);
  return MeshOf(PiecesOf(building, cells, snapshot));
}

TEST(Difficulty, LowSpaceAndEdgesAreNotWalkable) {
  const Terrain terrain(GroundAndTable());
  const Difficulty difficulty = MeasureDifficulty(terrain, {Eigen::Vector2d(-4, -4), Eigen::Vector2d(4, 4)});
  // 8 x 8 m of ground without the 2 x 2 m below the table, plus the table top without a rim.
  EXPECT_GT(difficulty.walkable_m2, 60.0);
  EXPECT_LT(difficulty.walkable_m2, 64.0);
  EXPECT_DOUBLE_EQ(difficulty.clearance_m, 3.0);
  EXPECT_LT(difficulty.height_variance_m2, 1e-2);
}

}  // namespace
}  // namespace legopt::worldgen
