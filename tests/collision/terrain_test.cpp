#include "legopt/collision/terrain.h"

#include <gtest/gtest.h>

#include "legopt/generate/difficulty.h"
#include "legopt/generate/pieces.h"

namespace legopt {
namespace {

/// Ground 10 x 10 m with a table of 2 x 2 m whose top is at 1 m and whose underside is at 0.8 m.
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

TEST(Terrain, FindsAllSurfacesThatLookUp) {
  const Terrain terrain(GroundAndTable());
  std::vector<Terrain::Hit> hits;
  terrain.Ground(0.3, 0.2, -2, 5, hits);
  ASSERT_EQ(hits.size(), 2u);
  EXPECT_DOUBLE_EQ(hits[0].z_m, 1.0);
  EXPECT_DOUBLE_EQ(hits[1].z_m, 0.0);
  EXPECT_NEAR(terrain.normal(hits[0].triangle).z(), 1.0, 1e-12);
  terrain.Ground(0.3, 0.2, -2, 0.5, hits);
  EXPECT_EQ(hits.size(), 1u);
  terrain.Ground(20, 0, -2, 5, hits);
  EXPECT_TRUE(hits.empty());
  EXPECT_DOUBLE_EQ(terrain.Highest(0.3, 0.2, -2, 5).z_m, 1.0);
  EXPECT_EQ(terrain.Highest(3, 3, 0.5, 5).triangle, -1);
}

TEST(Terrain, KnowsTheHeadroom) {
  const Terrain terrain(GroundAndTable());
  EXPECT_NEAR(terrain.NextAbove(0.3, 0.2, 0.0), 0.8, 1e-6);
  EXPECT_TRUE(std::isinf(terrain.NextAbove(3, 3, 0.0)));
  EXPECT_TRUE(std::isinf(terrain.NextAbove(0.3, 0.2, 1.0)));
}

TEST(Difficulty, LowSpaceAndEdgesAreNotWalkable) {
  const Terrain terrain(GroundAndTable());
  const Difficulty difficulty = MeasureDifficulty(terrain, {Eigen::Vector2d(-4, -4), Eigen::Vector2d(4, 4)});
  // 8 x 8 m of ground without the 2 x 2 m below the table, and its top without a rim.
  EXPECT_GT(difficulty.walkable_m2, 60.0);
  EXPECT_LT(difficulty.walkable_m2, 64.0);
  EXPECT_DOUBLE_EQ(difficulty.clearance_m, 3.0);
  EXPECT_LT(difficulty.height_variance_m2, 1e-2);
}

}  // namespace
}  // namespace legopt
