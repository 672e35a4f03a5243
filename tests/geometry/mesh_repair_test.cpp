// Policy: each test damages solids of known volume in one way, repairs them, and compares volume and counts.

#include "legopt/geometry/internal/mesh_repair.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "legopt/types/input_error.h"

namespace legopt {
namespace {

using Eigen::Vector3d;

TriangleMesh BoxAt(const Vector3d& low, const Vector3d& high) {
  ShapeSpec box;
  box.kind = ShapeSpec::Kind::kBox;
  box.size = high - low;
  box.pose.translation() = 0.5 * (low + high);
  return Tessellate(box);
}

TriangleMesh Ball(double radius_m) {
  ShapeSpec ball;
  ball.kind = ShapeSpec::Kind::kSphere;
  ball.size.x() = radius_m;
  return Tessellate(ball);
}

TriangleMesh Together(const std::vector<TriangleMesh>& parts) {
  TriangleMesh all;
  for (const TriangleMesh& part : parts) {
    const int first = static_cast<int>(all.vertices.size());
    all.vertices.insert(all.vertices.end(), part.vertices.begin(), part.vertices.end());
    for (const auto& [a, b, c] : part.triangles) all.triangles.push_back({first + a, first + b, first + c});
  }
  return all;
}

TriangleMesh Turned(TriangleMesh mesh) {
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

/// Removes the triangles whose centre fulfils the condition.
TriangleMesh Without(TriangleMesh mesh, const std::function<bool(const Vector3d&)>& condition) {
  std::erase_if(mesh.triangles, [&](const auto& t) {
    Vector3d centre = Vector3d::Zero();
    for (const int v : t) centre += mesh.vertices[static_cast<size_t>(v)] / 3.0;
    return condition(centre);
  });
  return mesh;
}

/// Gives every triangle vertices of its own, each moved by up to `noise_m` along each axis.
TriangleMesh Soup(const TriangleMesh& mesh, double noise_m) {
  std::mt19937 rng(7);
  std::uniform_real_distribution<double> noise(-noise_m, noise_m);
  TriangleMesh soup;
  for (const auto& t : mesh.triangles) {
    const int first = static_cast<int>(soup.vertices.size());
    for (const int v : t) {
      soup.vertices.push_back(mesh.vertices[static_cast<size_t>(v)] + Vector3d(noise(rng), noise(rng), noise(rng)));
    }
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  return soup;
}

/// A surface over a grid of cells in plan, wound upwards.
TriangleMesh Surface(int cells, double size_m, const std::function<double(double, double)>& height) {
  TriangleMesh mesh;
  for (int j = 0; j <= cells; ++j) {
    for (int i = 0; i <= cells; ++i) {
      const double x = size_m * i / cells, y = size_m * j / cells;
      mesh.vertices.emplace_back(x, y, height(x, y));
    }
  }
  for (int j = 0; j < cells; ++j) {
    for (int i = 0; i < cells; ++i) {
      const int a = j * (cells + 1) + i, b = a + 1, c = b + cells + 1, d = a + cells + 1;
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    }
  }
  return mesh;
}

RepairedMesh Repaired(const TriangleMesh& mesh, const MeshRepairOptions& options = {}) {
  const RepairedMesh repaired = RepairMesh(mesh, options);
  EXPECT_EQ(repaired.mesh.triangles.size(), repaired.origins.size());
  return repaired;
}

void ExpectSolid(const RepairedMesh& repaired, double volume_m3, double relative = 1e-5) {
  EXPECT_EQ(repaired.faults.open_edges, 0);
  EXPECT_NEAR(repaired.volume_m3, volume_m3, relative * volume_m3);
  EXPECT_EQ(repaired.faults.inverted_components, repaired.counts.cavities);
}

const TriangleMesh kBrick = BoxAt({0, 0, 0}, {2, 3, 4});
constexpr double kBrick_m3 = 24.0;
constexpr auto kTop = [](const Vector3d& centre) { return centre.z() > 3.9; };

TEST(MeshRepair, AGoodMeshStaysAsItIs) {
  const TriangleMesh mesh = Together({kBrick, BoxAt({5, 5, 5}, {6, 6, 6}), Ball(0.5)});
  const RepairedMesh repaired = Repaired(mesh);
  EXPECT_TRUE(repaired.counts.none()) << ToString(repaired.counts);
  EXPECT_EQ(repaired.mesh.triangles, mesh.triangles);
  EXPECT_THAT(repaired.origins, testing::Each(TriangleOrigin::kKept));
}

TEST(MeshRepair, NearVerticesAreWelded) {
  for (const double noise_m : {1e-9, 1e-6, 2.5e-6}) {
    for (const bool close : {false, true}) {
      const RepairedMesh repaired = Repaired(Soup(kBrick, noise_m), {.close = close});
      ExpectSolid(repaired, kBrick_m3);
      EXPECT_EQ(repaired.mesh.vertices.size(), 8U);
      EXPECT_EQ(repaired.mesh.triangles.size(), 12U);
      EXPECT_EQ(repaired.counts.capped_holes + repaired.counts.added_triangles, 0);
    }
  }
  EXPECT_GT(Repaired(Soup(kBrick, 1e-4), {.close = false}).faults.open_edges, 0) << "wider than the tolerance";
  ExpectSolid(Repaired(Soup(kBrick, 1e-4), {.weld_m = 1e-3}), kBrick_m3, 1e-3);
}

TEST(MeshRepair, DuplicatesAreRemoved) {
  TriangleMesh mesh = kBrick;
  mesh.triangles.insert(mesh.triangles.end(), kBrick.triangles.begin(), kBrick.triangles.begin() + 5);
  mesh.triangles.push_back({kBrick.triangles[0][1], kBrick.triangles[0][2], kBrick.triangles[0][0]});
  EXPECT_EQ(CountDuplicates(mesh), 6);
  const RepairedMesh repaired = Repaired(mesh, {.close = false});
  EXPECT_EQ(repaired.counts.duplicate_triangles, 6);
  EXPECT_EQ(repaired.mesh.triangles, kBrick.triangles);
}

TEST(MeshRepair, TrianglesWithoutAreaAreRemovedUnlessTheyCloseTheSurface) {
  TriangleMesh loose = kBrick;
  loose.triangles.push_back({0, 1, 1});
  loose.vertices.emplace_back(7, 0, 0);
  loose.vertices.emplace_back(8, 0, 0);
  loose.vertices.emplace_back(9, 0, 0);
  loose.triangles.push_back({8, 9, 10});
  const RepairedMesh repaired = Repaired(loose, {.close = false});
  EXPECT_EQ(repaired.counts.degenerate_triangles, 2);
  EXPECT_EQ(repaired.mesh.triangles, kBrick.triangles);
  EXPECT_EQ(repaired.mesh.vertices.size(), 8U);

  // A top edge is divided on one side; a triangle without area fills the slit.
  TriangleMesh slit = Without(kBrick, kTop);
  const int v = static_cast<int>(slit.vertices.size());
  slit.vertices.emplace_back(1, 0, 4);
  slit.triangles.insert(slit.triangles.end(), {{4, v, 6}, {v, 5, 7}, {v, 7, 6}, {4, 5, v}});
  EXPECT_TRUE(IsClosed(slit));
  EXPECT_EQ(Repaired(slit, {.close = false}).mesh.triangles, slit.triangles);
  const RepairedMesh closed = Repaired(slit);
  ExpectSolid(closed, kBrick_m3);
  EXPECT_EQ(closed.counts.degenerate_triangles, 1);
  EXPECT_EQ(closed.counts.split_triangles, 1);
}

TEST(MeshRepair, MixedWindingIsMadeOutwards) {
  const TriangleMesh good = Together({kBrick, BoxAt({5, 5, 5}, {6, 6, 6}), Ball(0.5)});
  const double volume_m3 = EnclosedVolume(good);
  for (unsigned seed = 1; seed <= 20; ++seed) {
    TriangleMesh mixed = good;
    std::mt19937 rng(seed);
    for (auto& t : mixed.triangles) {
      if (rng() % 2 == 0) std::swap(t[1], t[2]);
    }
    const RepairedMesh repaired = Repaired(mixed, {.close = false});
    ExpectSolid(repaired, volume_m3);
    EXPECT_GT(repaired.counts.turned_triangles, 0);
  }
}

TEST(MeshRepair, TouchingBodiesOfMixedWindingKeepTheirVolume) {
  // A shared edge, and a shared face.
  for (const Vector3d& at : {Vector3d(2, 3, 0), Vector3d(2, 0, 0), Vector3d(0, 0, 4)}) {
    for (unsigned seed = 0; seed < 20; ++seed) {
      TriangleMesh mixed = Together({kBrick, BoxAt(at, at + Vector3d(2, 3, 4))});
      std::mt19937 rng(seed);
      for (auto& t : mixed.triangles) {
        if (seed > 0 && rng() % 2 == 0) std::swap(t[1], t[2]);
      }
      ExpectSolid(Repaired(mixed), 2.0 * kBrick_m3);
    }
  }
}

TEST(MeshRepair, InvertedBodiesAreTurnedAndCavitiesStay) {
  const TriangleMesh small = BoxAt({5, 5, 5}, {6, 6, 6});
  const RepairedMesh one = Repaired(Together({kBrick, Turned(small)}));
  ExpectSolid(one, kBrick_m3 + 1.0);
  EXPECT_EQ(one.counts.turned_bodies, 1);
  EXPECT_EQ(one.counts.turned_triangles, 12);
  ExpectSolid(Repaired(Turned(Together({kBrick, small}))), kBrick_m3 + 1.0);

  const TriangleMesh inner = BoxAt({0.5, 0.5, 0.5}, {1.5, 2.5, 3.5});
  const RepairedMesh room = Repaired(Together({kBrick, Turned(inner)}));
  ExpectSolid(room, kBrick_m3 - 6.0);
  EXPECT_EQ(room.counts.cavities, 1);
  EXPECT_EQ(room.counts.turned_triangles, 0);
  ExpectSolid(Repaired(Together({Turned(kBrick), inner})), kBrick_m3 - 6.0);
  EXPECT_EQ(Repaired(Together({kBrick, inner})).counts.cavities, 0);
}

TEST(MeshRepair, JunctionsAreStitched) {
  // The bottom is one face, the walls are cut: vertices of the walls lie on edges of the bottom.
  TriangleMesh mesh = Without(kBrick, [](const Vector3d& centre) { return centre.y() < 0.1 && centre.z() < 3.9; });
  const int v = static_cast<int>(mesh.vertices.size());
  for (const double x : {0.5, 1.2}) {
    mesh.vertices.emplace_back(x, 0, 0);
    mesh.vertices.emplace_back(x, 1e-6, 4);
  }
  for (const auto& [a, b, c, d] :
       {std::array{0, v, v + 1, 4}, std::array{v, v + 2, v + 3, v + 1}, std::array{v + 2, 1, 5, v + 3}}) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  }
  const RepairedMesh repaired = Repaired(mesh);
  ExpectSolid(repaired, kBrick_m3);
  EXPECT_EQ(repaired.counts.split_triangles, 2);
  EXPECT_EQ(repaired.counts.added_triangles, 0);
  EXPECT_GT(Repaired(mesh, {.close = false}).faults.open_edges, 0);
}

TEST(MeshRepair, PlanarHolesAreCapped) {
  const RepairedMesh open_top = Repaired(Without(kBrick, kTop));
  ExpectSolid(open_top, kBrick_m3);
  EXPECT_EQ(open_top.counts.capped_holes, 1);
  EXPECT_EQ(open_top.counts.added_triangles, 2);
  EXPECT_EQ(std::count(open_top.origins.begin(), open_top.origins.end(), TriangleOrigin::kAdded), 2);

  TriangleMesh triangle = kBrick;
  triangle.triangles.pop_back();
  ExpectSolid(Repaired(triangle), kBrick_m3);

  const RepairedMesh tube = Repaired(Without(kBrick, [](const Vector3d& c) { return c.z() > 3.9 || c.z() < 0.1; }));
  ExpectSolid(tube, kBrick_m3);
  EXPECT_EQ(tube.counts.capped_holes, 2);

  const RepairedMesh upside_down =
      Repaired(Turned(Without(kBrick, [](const Vector3d& centre) { return centre.z() < 0.1; })));
  ExpectSolid(upside_down, kBrick_m3);
  EXPECT_EQ(upside_down.counts.turned_bodies, 1);
}

TEST(MeshRepair, TheEndOfAPipeIsCappedAsARing) {
  TriangleMesh pipe;
  constexpr int kSides = 24;
  for (const auto& [radius, z] : {std::pair(1.0, 0.0), std::pair(1.0, 3.0), std::pair(0.6, 3.0), std::pair(0.6, 0.0)}) {
    for (int s = 0; s < kSides; ++s) {
      const double angle = 2.0 * std::numbers::pi * s / kSides;
      pipe.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
    }
  }
  for (int ring = 0; ring < 4; ++ring) {
    for (int s = 0; s < kSides; ++s) {
      const int a = ring * kSides + s, b = ring * kSides + (s + 1) % kSides;
      const int c = (ring + 1) % 4 * kSides + (s + 1) % kSides, d = (ring + 1) % 4 * kSides + s;
      pipe.triangles.push_back({a, b, c});
      pipe.triangles.push_back({a, c, d});
    }
  }
  const double volume_m3 = EnclosedVolume(pipe);
  ASSERT_GT(volume_m3, 5.0);
  const RepairedMesh open = Repaired(Without(pipe, [](const Vector3d& c) { return c.z() > 2.9; }));
  ExpectSolid(open, volume_m3);
  EXPECT_EQ(open.counts.capped_holes, 1);
  ExpectSolid(Repaired(Without(pipe, [](const Vector3d& c) { return c.z() > 2.9 || c.z() < 0.1; })), volume_m3);
}

TEST(MeshRepair, AHoleWithCornersInwardsIsCapped) {
  // A prism over a star, without its top.
  TriangleMesh star;
  constexpr int kPoints = 20;
  for (const double z : {0.0, 1.0}) {
    for (int k = 0; k < kPoints; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / kPoints, radius = k % 2 == 0 ? 2.0 : 0.7;
      star.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
    }
  }
  star.vertices.emplace_back(0, 0, 0);
  for (int k = 0; k < kPoints; ++k) {
    const int next = (k + 1) % kPoints;
    star.triangles.push_back({k, next, kPoints + next});
    star.triangles.push_back({k, kPoints + next, kPoints + k});
    star.triangles.push_back({next, k, 2 * kPoints});
  }
  const double area_m2 = 0.5 * kPoints * 2.0 * 0.7 * std::sin(2.0 * std::numbers::pi / kPoints);
  ExpectSolid(Repaired(star), area_m2);
}

TEST(MeshRepair, SmallUnevenHolesAreCappedAndCounted) {
  const TriangleMesh ball = Ball(1.0);
  TriangleMesh damaged = Without(ball, [](const Vector3d& c) { return (c - Vector3d(0.9, 0.1, 0.4)).norm() < 0.25; });
  ASSERT_LT(damaged.triangles.size() + 3, ball.triangles.size());
  const RepairedMesh repaired = Repaired(damaged);
  ExpectSolid(repaired, EnclosedVolume(ball), 0.01);
  EXPECT_EQ(repaired.counts.capped_holes, 1);
  EXPECT_EQ(repaired.counts.uneven_holes, 1);
}

TEST(MeshRepair, GroundSheetsAreThickenedDownwards) {
  for (const bool turned : {false, true}) {
    TriangleMesh sheet = Surface(4, 6.0, [](double x, double) { return 0.2 * x; });
    if (turned) sheet = Turned(sheet);
    const RepairedMesh repaired = Repaired(sheet, {.ground_thickness_m = 0.25});
    ExpectSolid(repaired, 36.0 * 0.25);
    EXPECT_EQ(repaired.counts.thickened_ground, 1);
    double top = -1.0, bottom = 1.0;
    for (const Vector3d& v : repaired.mesh.vertices) {
      top = std::max(top, v.z());
      bottom = std::min(bottom, v.z());
    }
    EXPECT_NEAR(top, 1.2, 1e-6);
    EXPECT_NEAR(bottom, -0.25, 1e-6);
  }
}

TEST(MeshRepair, TerrainIsThickenedWhateverItsBorder) {
  const auto hill = [](double x, double y) {
    const double r = std::hypot(x - 3.0, y - 3.0);
    return r < 2.0 ? 0.3 * (1.0 + std::cos(std::numbers::pi * r / 2.0)) : 0.0;
  };
  for (const auto& height : std::vector<std::function<double(double, double)>>{
           hill, [](double x, double y) { return 0.3 * std::sin(x) * std::cos(2.0 * y); },
           [&](double x, double y) { return -hill(x, y); }}) {
    const RepairedMesh repaired = Repaired(Surface(24, 6.0, height), {.ground_thickness_m = 0.5});
    ExpectSolid(repaired, 18.0);
    EXPECT_EQ(repaired.counts.thickened_ground, 1);
  }
}

TEST(MeshRepair, StepsOfASheetStandOnAFlatFloor) {
  // Two treads at 0 and 0.5 m with a riser between them.
  TriangleMesh steps;
  for (const auto& [x, z] : {std::pair(0.0, 0.0), std::pair(1.0, 0.0), std::pair(1.0, 0.5), std::pair(2.0, 0.5)}) {
    steps.vertices.emplace_back(x, 0.0, z);
    steps.vertices.emplace_back(x, 3.0, z);
  }
  for (int k = 0; k < 3; ++k) {
    steps.triangles.push_back({2 * k, 2 * k + 2, 2 * k + 3});
    steps.triangles.push_back({2 * k, 2 * k + 3, 2 * k + 1});
  }
  ExpectSolid(Repaired(steps, {.ground_thickness_m = 0.2}), 3.0 * (0.2 + 0.7));
}

TEST(MeshRepair, WallsAreThickenedOnBothSides) {
  TriangleMesh wall = Surface(3, 2.0, [](double, double) { return 0.0; });
  for (Vector3d& v : wall.vertices) v = Vector3d(1.0, v.x(), v.y());
  const RepairedMesh repaired = Repaired(wall, {.wall_thickness_m = 0.04});
  ExpectSolid(repaired, 4.0 * 0.04);
  EXPECT_EQ(repaired.counts.thickened_walls, 1);
  double low = 2.0, high = 0.0;
  for (const Vector3d& v : repaired.mesh.vertices) {
    low = std::min(low, v.x());
    high = std::max(high, v.x());
  }
  EXPECT_NEAR(low, 0.98, 1e-6);
  EXPECT_NEAR(high, 1.02, 1e-6);
  // A wall on solid ground, along an edge of the ground's top.
  TriangleMesh scene = Together({BoxAt({0, 0, -1}, {2, 2, 0}), wall});
  for (size_t v = 8; v < scene.vertices.size(); ++v) scene.vertices[v].x() = 0.0;
  const RepairedMesh both = Repaired(scene);
  ExpectSolid(both, 4.0 + 4.0 * 0.01);
  EXPECT_EQ(both.counts.thickened_walls, 1);
}

TEST(MeshRepair, SheetsWithTwoFacesAreThickenedOnce) {
  const TriangleMesh sheet = Surface(2, 2.0, [](double, double) { return 0.0; });
  const TriangleMesh both = Together({sheet, Turned(sheet)});
  const RepairedMesh repaired = Repaired(both);
  ExpectSolid(repaired, 0.4);
  EXPECT_EQ(repaired.counts.thickened_ground, 1);
  EXPECT_EQ(repaired.counts.duplicate_triangles, 8);
  TriangleMesh welded = sheet;
  for (const auto& [a, b, c] : sheet.triangles) welded.triangles.push_back({a, c, b});
  EXPECT_EQ(CountFlatBodies(welded), 1);
  EXPECT_EQ(CountFlatBodies(kBrick), 0);
}

TEST(MeshRepair, BodiesWithTwoFacesBecomeOneBody) {
  TriangleMesh both = kBrick;
  for (const auto& [a, b, c] : kBrick.triangles) both.triangles.push_back({a, c, b});
  const RepairedMesh repaired = Repaired(both);
  ExpectSolid(repaired, kBrick_m3);
  EXPECT_EQ(repaired.mesh.triangles.size(), 12U);
}

TEST(MeshRepair, ARoomOpenAtTheTopGetsWallsNotAFilling) {
  const TriangleMesh room = Turned(Without(kBrick, kTop));
  const RepairedMesh repaired = Repaired(room, {.wall_thickness_m = 0.1});
  ExpectSolid(repaired, 2.2 * 3.2 * 4.1 - kBrick_m3);
  EXPECT_EQ(repaired.counts.thickened_walls, 1);
}

TEST(MeshRepair, RandomDamageIsRepaired) {
  const TriangleMesh good = Together({BoxAt({-5, -5, -1}, {5, 5, 0}), BoxAt({1, 1, 0.5}, {2, 2, 1.5}), Ball(0.3)});
  const double volume_m3 = EnclosedVolume(good);
  for (unsigned seed = 0; seed < 50; ++seed) {
    std::mt19937 rng(seed);
    TriangleMesh damaged = Soup(good, 2e-6);
    for (auto& t : damaged.triangles) {
      if (rng() % 4 == 0) std::swap(t[1], t[2]);
    }
    damaged.triangles.push_back(damaged.triangles[rng() % damaged.triangles.size()]);
    const size_t removed = rng() % 24;  // of a box: a planar hole
    damaged.triangles.erase(damaged.triangles.begin() + static_cast<std::ptrdiff_t>(removed));
    ExpectSolid(Repaired(damaged), volume_m3, 1e-4);
  }
}

TEST(MeshRepair, OptionsAreChecked) {
  const auto message = [](const MeshRepairOptions& options) -> std::string {
    try {
      RepairMesh(kBrick, options);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(message({.weld_m = -1.0}), testing::HasSubstr("--weld"));
  EXPECT_THAT(message({.weld_m = std::nan("")}), testing::HasSubstr("--weld"));
  EXPECT_THAT(message({.wall_thickness_m = 0.0}), testing::HasSubstr("--thickness"));
  EXPECT_THAT(message({.weld_m = 0.0}), "");
}

TEST(MeshRepair, AnEmptyMeshStaysEmpty) {
  const RepairedMesh repaired = Repaired({});
  EXPECT_TRUE(repaired.counts.none());
  EXPECT_EQ(ToString(repaired.counts), "nothing to repair");
}

}  // namespace
}  // namespace legopt
