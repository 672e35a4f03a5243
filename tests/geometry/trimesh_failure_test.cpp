// Mesh queries in which ODE fails an assertion that would abort the process. Its contact table has four places per
// bucket, and it asserts that a removed contact is found in its bucket, which fails if the bucket was full.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "legopt/geometry/internal/trimesh_world.h"
#include "tests/geometry/atlas_data.h"
#include "tests/geometry/test_shapes.h"

namespace legopt::test {
namespace {

constexpr double kMerging = 1e-5;  // m; ODE merges contacts in one cell of 0.1 mm whose depths differ by less

/// Returns a two-sided triangle in the middle of a layer of ODE's contact cells.
TriangleMesh DoublePlate() {
  constexpr double kHeight = 5e-5, kFar = 3.0;
  TriangleMesh plate;
  plate.vertices = {{-1, -1, kHeight}, {kFar, -1, kHeight}, {-1, kFar, kHeight}};
  plate.triangles = {{0, 1, 2}, {0, 2, 1}};
  return plate;
}

/// Returns needles through the plate. Every second one ends so near to the plate, on both sides, that its two contacts
/// cancel each other and are removed.
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

/// Returns one triangle of a mesh and a second, far away at `far_x`, because ODE cannot collide a mesh of one
/// triangle.
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

/// Returns ODE's largest depth, computed for one needle and one side of the plate at a time.
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

Eigen::Isometry3d Pose(const Eigen::Vector3d& position, const Eigen::Matrix3d& rotation) {
  return Eigen::Translation3d(position) * Eigen::Isometry3d(rotation);
}

std::vector<TriangleMesh> LinkMeshes(const RobotModel& robot, std::size_t triangles) {
  std::vector<TriangleMesh> meshes;
  for (const auto& link : robot.links()) {
    for (const ShapeSpec& spec : link.collision) {
      TriangleMesh mesh = Tessellate(spec, robot.read_guard());
      if (mesh.triangles.size() == triangles) meshes.push_back(std::move(mesh));
    }
  }
  return meshes;
}

/// Returns ODE's largest depth, computed for `share` triangles of A at a time.
double DepthOfParts(const TriangleMesh& a, const Eigen::Isometry3d& pose_a, const TriangleMesh& b,
                    const Eigen::Isometry3d& pose_b, std::size_t share) {
  double deepest = -1.0;
  for (std::size_t first = 0; first < a.triangles.size(); first += share) {
    TriangleMesh part{.vertices = a.vertices, .triangles = {}};
    const std::size_t end = std::min(first + share, a.triangles.size());
    for (std::size_t t = first; t < end; ++t) part.triangles.push_back(a.triangles[t]);
    TrimeshWorld world;
    const int number_a = world.Add(std::move(part)), number_b = world.Add(b);
    world.SetPose(number_a, pose_a);
    world.SetPose(number_b, pose_b);
    deepest = std::max(deepest, world.Depth(number_a, number_b));
  }
  return deepest;
}

// A query between two waypoints of LegOpt's motion 21 as solved by SQP without restarts (seed 7, good start).
TEST(TrimeshFailure, TheAtlasQueryThatEndedAJobIsAnswered) {
  constexpr std::size_t kTrianglesOfA = 1438, kTrianglesOfB = 1950, kShare = 100;
  LEGOPT_REQUIRE_FILE(DataFolder() / "atlas/atlas.urdf");
  Eigen::Matrix3d rotation_a, rotation_b;
  rotation_a << 0.39983501321307302, 0.80327427239440108, 0.4414548737052828, -0.86695175356053822, 0.48777224775711292,
      -0.10233714533971172, -0.29753423199223517, -0.34180210301754921, 0.89142846216932714;
  rotation_b << 0.70132851414766662, 0.64244500238236035, -0.30887333027853803, -0.59397413656311004,
      0.76624428377078901, 0.24508044124878339, 0.39412312839712138, 0.01158086795190319, 0.91898468059045835;
  const auto pose_a = Pose({-10.496856161806416, 0.13313138039594696, 2.0827030336363794}, rotation_a);
  const auto pose_b = Pose({-10.595912298991085, 0.24543367939277336, 2.4063048031054755}, rotation_b);
  const RobotModel robot = Atlas();
  std::int64_t failures = 0;
  for (const TriangleMesh& a : LinkMeshes(robot, kTrianglesOfA)) {
    for (const TriangleMesh& b : LinkMeshes(robot, kTrianglesOfB)) {
      TrimeshWorld world;
      const int number_a = world.Add(a), number_b = world.Add(b);
      world.SetPose(number_a, pose_a);
      world.SetPose(number_b, pose_b);
      const TrimeshWorld::Depths depths = world.AllDepths(number_a, number_b);
      if (world.ode_failures() == 0) continue;
      ++failures;
      EXPECT_GT(depths.original_m, 0.0);
      EXPECT_EQ(depths.original_m, world.ExactDepth(number_a, number_b));
      EXPECT_NEAR(depths.original_m, DepthOfParts(a, pose_a, b, pose_b, kShare), kMerging);
    }
  }
  if (failures == 0) GTEST_SKIP() << "this ODE is built without assertions, or these are other meshes";
}

// For a mesh of one triangle ODE dereferences a null pointer: it crashes, or misses a contact.
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

// Many queries, some of which fail. The state that ODE keeps between queries must be correct after each.
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
