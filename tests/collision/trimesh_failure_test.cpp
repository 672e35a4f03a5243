// Queries of two meshes in which ODE fails an assertion, and would end the process: its table of contacts has four
// places per bucket, and removing a contact that found its bucket full is an assertion.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <random>
#include <vector>

#include "legopt/collision/trimesh_world.h"
#include "tests/collision/test_shapes.h"

namespace legopt::test {
namespace {

constexpr double kMerging = 1e-5;  // ODE keeps the first of two depths in one cell of 0.1 mm that differ by less, m

/// A triangle that can be seen from both sides, in the middle of a layer of ODE's cells of contacts.
TriangleMesh DoublePlate() {
  constexpr double kHeight = 5e-5, kFar = 3.0;
  TriangleMesh plate;
  plate.vertices = {{-1, -1, kHeight}, {kFar, -1, kHeight}, {-1, kFar, kHeight}};
  plate.triangles = {{0, 1, 2}, {0, 2, 1}};
  return plate;
}

/// Needles through the plate. Every second one ends so near to the plate, on both sides, that its two contacts cancel
/// each other and are removed.
TriangleMesh Needles(unsigned seed) {
  constexpr double kHeight = 5e-5, kWidth = 1e-5, kShort = 2e-5, kLong = 1e-2;
  constexpr double kFewest = 60, kSpread = 100, kRange = 4294967296.0;
  std::mt19937 generator(seed);
  const auto draw = [&] { return static_cast<double>(generator()) / kRange; };
  const int count = static_cast<int>(kFewest) + static_cast<int>(draw() * kSpread);
  TriangleMesh needles;
  for (int i = 0; i < count; ++i) {
    const double x = draw(), y = draw();
    double reach = kShort * (0.5 + draw());
    if (i % 2 == 1) reach = kLong * draw();
    const int first = 3 * i;
    needles.vertices.emplace_back(x, y, kHeight - reach);
    needles.vertices.emplace_back(x + kWidth, y, kHeight + reach);
    needles.vertices.emplace_back(x, y + kWidth, kHeight + reach);
    needles.triangles.push_back({first, first + 1, first + 2});
  }
  return needles;
}

/// One triangle of a mesh, and another one far away at `far_x`: ODE cannot collide a single one.
TriangleMesh OnlyTriangle(const TriangleMesh& mesh, std::size_t number, double far_x) {
  TriangleMesh one;
  for (const int corner : mesh.triangles[number]) {
    one.vertices.push_back(mesh.vertices[static_cast<std::size_t>(corner)]);
  }
  for (const Eigen::Vector3d& corner :
       {Eigen::Vector3d(far_x, 0, 0), Eigen::Vector3d(far_x + 1, 0, 0), Eigen::Vector3d(far_x, 1, 0)}) {
    one.vertices.push_back(corner);
  }
  one.triangles = {{0, 1, 2}, {3, 4, 5}};
  return one;
}

/// The largest depth by ODE, asked about one needle and one side of the plate at a time.
double DepthOfPieces(const TriangleMesh& plate, const TriangleMesh& needles) {
  constexpr double kFarPlate = 100.0, kFarNeedle = -100.0;
  double deepest = -1.0;
  for (std::size_t side = 0; side < plate.triangles.size(); ++side) {
    for (std::size_t i = 0; i < needles.triangles.size(); ++i) {
      TrimeshWorld world;
      const int a = world.Add(OnlyTriangle(plate, side, kFarPlate));
      const int b = world.Add(OnlyTriangle(needles, i, kFarNeedle));
      deepest = std::max(deepest, world.Depth(a, b));
      EXPECT_EQ(world.ode_failures(), 0);
    }
  }
  return deepest;
}

TEST(TrimeshFailure, AFailedAssertionOfOdeIsAnsweredByTheExactTriangleTest) {
  const TriangleMesh plate = DoublePlate(), needles = Needles(35);
  TrimeshWorld world;
  const int a = world.Add(plate), b = world.Add(needles);
  const TrimeshWorld::Depths depths = world.AllDepths(a, b);
  if (world.ode_failures() == 0) GTEST_SKIP() << "this ODE is built without assertions";
  EXPECT_EQ(world.ode_failures(), 1);
  EXPECT_EQ(depths.original_m, world.ExactDepth(a, b));
  EXPECT_EQ(depths.all_m, depths.original_m);
  EXPECT_NEAR(depths.original_m, DepthOfPieces(plate, needles), kMerging);
  EXPECT_EQ(world.Depth(a, b), depths.original_m);
  EXPECT_EQ(world.ode_failures(), 2);
}

// ODE reads a null pointer for a mesh of one triangle: a crash, or no contact where there is one.
TEST(TrimeshFailure, ASingleTriangleIsAnsweredByTheExactTriangleTest) {
  constexpr double kDeep = 0.1;
  TriangleMesh face, needle;
  face.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  needle.vertices = {{0.2, 0.2, -kDeep}, {0.3, 0.2, 1}, {0.2, 0.3, 1}};
  face.triangles = needle.triangles = {{0, 1, 2}};
  TrimeshWorld world;
  const int a = world.Add(face), b = world.Add(needle);
  const int floor = world.Add(Tessellate(Spec(ShapeSpec::Kind::kBox, {2, 2, 2}, At(0, 0, -1))));
  EXPECT_NEAR(world.Depth(a, b), kDeep, 1e-12);
  EXPECT_NEAR(world.AllDepths(b, a).all_m, kDeep, 1e-12);
  EXPECT_NEAR(world.Depth(b, floor), kDeep, 1e-12);
  world.SetPose(b, At(0, 0, 1));
  EXPECT_LT(world.Depth(a, b), 0.0);
  EXPECT_EQ(world.ode_failures(), 0);
}

// Many queries, some of which fail; what ODE keeps between queries must be right after each.
TEST(TrimeshFailure, QueriesAfterAFailureAreRight) {
  constexpr unsigned kQueries = 200;
  const std::array<double, 3> sunk_m = {0.0005, 0.004, 0.02};
  TrimeshWorld world;
  const int plate = world.Add(DoublePlate());
  const int box = world.Add(Tessellate(Spec(ShapeSpec::Kind::kBox, {0.26, 0.13, 0.06})));
  const int floor = world.Add(Tessellate(Spec(ShapeSpec::Kind::kBox, {2, 2, 2})));
  std::int64_t failures = 0;
  for (unsigned seed = 0; seed < kQueries; ++seed) {
    const int needles = world.Add(Needles(seed));
    const double depth = world.Depth(plate, needles);
    EXPECT_NEAR(depth, world.ExactDepth(plate, needles), kMerging) << seed;
    const bool failed = world.ode_failures() > failures;
    failures = world.ode_failures();
    const double sunk = sunk_m[seed % sunk_m.size()];
    world.SetPose(box, At(0.013, 0.007, 1.03 - sunk));
    EXPECT_NEAR(world.Depth(box, floor), sunk, 1e-6) << seed << (failed ? ", after a failure" : "");
    world.SetPose(box, At(0.013, 0.007, 1.031));
    EXPECT_LT(world.Depth(box, floor), 0.0) << seed;
  }
  EXPECT_EQ(world.ode_failures(), failures);
  if (failures == 0) GTEST_SKIP() << "this ODE is built without assertions";
}

}  // namespace
}  // namespace legopt::test
