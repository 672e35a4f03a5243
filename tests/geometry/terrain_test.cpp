#include "legopt/geometry/internal/terrain.h"

#include <gtest/gtest.h>

#include "tests/geometry/test_shapes.h"

namespace legopt {
namespace {

using test::At;
using test::Spec;

/// Returns a ground of 10 x 10 m with a table of 2 x 2 m, whose top is at 1 m and whose underside is at 0.8 m.
TriangleMesh GroundAndTable() {
  TriangleMesh all = Tessellate(Spec(ShapeSpec::Kind::kBox, {10, 10, 1}, At(0, 0, -0.5)));
  const TriangleMesh table = Tessellate(Spec(ShapeSpec::Kind::kBox, {2, 2, 0.2}, At(0, 0, 0.9)));
  const int first = static_cast<int>(all.vertices.size());
  all.vertices.insert(all.vertices.end(), table.vertices.begin(), table.vertices.end());
  for (const auto& [a, b, c] : table.triangles) all.triangles.push_back({first + a, first + b, first + c});
  return all;
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
  EXPECT_NEAR(terrain.CeilingHeight(0.3, 0.2, 0.0), 0.8, 1e-6);
  EXPECT_TRUE(std::isinf(terrain.CeilingHeight(3, 3, 0.0)));
  EXPECT_TRUE(std::isinf(terrain.CeilingHeight(0.3, 0.2, 1.0)));
}

}  // namespace
}  // namespace legopt
