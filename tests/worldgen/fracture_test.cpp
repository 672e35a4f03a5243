#include "legopt/worldgen/internal/fracture.h"

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>

#include "legopt/geometry/internal/mesh_bodies.h"
#include "legopt/geometry/internal/mesh_file.h"
#include "legopt/worldgen/internal/collapse.h"
#include "tests/dataset/test_data.h"

namespace legopt::worldgen {
namespace {

using Eigen::Vector3d;

/// Returns a slab on two columns over fixed ground, and a loose block on the slab.
Building Portal() {
  Building building;
  BuildingParts parts(&building);
  parts.Box("ground", {-5, -5, -1}, {5, 5, 0}, Material::kGround, 0.0).fixed = true;
  parts.Box("left", {-2, -0.5, 0}, {-1.5, 0.5, 2}, Material::kConcrete, 0.8);
  parts.Box("right", {1.5, -0.5, 0}, {2, 0.5, 2}, Material::kConcrete, 0.8);
  parts.Box("slab", {-2, -0.5, 2}, {2, 0.5, 2.3}, Material::kConcrete, 0.7);
  parts.Box("block", {-0.2, -0.2, 2.3}, {0.2, 0.2, 2.6}, Material::kTimber, 0.0).prop = 0;
  building.foci = {{0, 0, 1}};
  building.plan = {Eigen::Vector2d(-3, -3), Eigen::Vector2d(3, 3)};
  building.storeys_m = {0.0, 2.3};
  return building;
}

TEST(Fracture, CellsFillTheirMembersExactly) {
  const Building building = Portal();
  std::mt19937_64 generator(1);
  const std::vector<Cell> cells = Fracture(building, {}, generator);
  std::vector<double> volume(building.members.size(), 0.0);
  for (const Cell& cell : cells) {
    EXPECT_GT(cell.volume_m3, 0.0);
    volume[static_cast<size_t>(cell.member)] += cell.volume_m3;
  }
  const std::vector<double> expected = {100.0, 1.0, 1.0, 1.2, 0.048};
  for (size_t m = 0; m < volume.size(); ++m) EXPECT_NEAR(volume[m], expected[m], 1e-9) << m;
  EXPECT_GT(cells.size(), 10u);
}

TEST(Fracture, PrismsThatAreNoBoxesAreFilledToo) {
  Building building;
  BuildingParts(&building).Hull("gable", {{0, 0, 0}, {0.3, 0, 0}, {0, 4, 0}, {0.3, 4, 0}, {0, 2, 2}, {0.3, 2, 2}},
                                Material::kMasonry, 0.8);
  building.foci = {{0, 0, 0}};
  std::mt19937_64 generator(3);
  double volume = 0.0;
  for (const Cell& cell : Fracture(building, {}, generator)) volume += cell.volume_m3;
  EXPECT_NEAR(volume, 0.5 * 4 * 2 * 0.3, 1e-9);
}

TEST(Fracture, SameSeedSameCells) {
  const Building building = Portal();
  std::mt19937_64 first(7);
  std::mt19937_64 second(7);
  std::mt19937_64 other(8);
  const auto a = Fracture(building, {}, first);
  const auto b = Fracture(building, {}, second);
  const auto c = Fracture(building, {}, other);
  ASSERT_EQ(a.size(), b.size());
  bool differs = a.size() != c.size();
  for (size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].vertices, b[i].vertices);
    differs = differs || a[i].vertices != c[i].vertices;
  }
  EXPECT_TRUE(differs);
}

TEST(Fracture, BondsJoinWhatTouchesButNoLooseBodies) {
  const Building building = Portal();
  std::mt19937_64 generator(1);
  const std::vector<Cell> cells = Fracture(building, {}, generator);
  double to_ground = 0.0;
  double within_slab_and_columns = 0.0;
  for (const Bond& bond : FindBonds(building, cells)) {
    const int a = cells[static_cast<size_t>(bond.a)].member;
    const int b = cells[static_cast<size_t>(bond.b)].member;
    EXPECT_LT(bond.a, bond.b);
    EXPECT_NE(a, 4);
    EXPECT_NE(b, 4);
    if (a == 0) to_ground += bond.area_m2;
    if (a != 0 && b == 3 && a != 3) within_slab_and_columns += bond.area_m2;
    const Vector3d apart = cells[static_cast<size_t>(bond.b)].centroid - cells[static_cast<size_t>(bond.a)].centroid;
    EXPECT_GT(bond.normal.dot(apart), 0.0);
  }
  constexpr double kSlivers = 0.01;  // contacts below the minimum area are no bonds
  EXPECT_NEAR(to_ground, 2 * 0.5, kSlivers);
  EXPECT_NEAR(within_slab_and_columns, 2 * 0.5, kSlivers);
}

TEST(Pieces, MeshOfCellsIsClosedAndWoundOutwards) {
  const Building building = Portal();
  std::mt19937_64 generator(1);
  const std::vector<Cell> cells = Fracture(building, {}, generator);
  Snapshot snapshot;
  snapshot.cells.resize(cells.size());
  EXPECT_EQ(PiecesOf(building, cells, snapshot).size(), building.members.size());
  for (CellState& state : snapshot.cells) {
    state.moved = true;
    state.motion = Eigen::AngleAxisd(0.3, Vector3d(1, 2, 3).normalized());
  }
  const auto pieces = PiecesOf(building, cells, snapshot);
  EXPECT_EQ(pieces.size(), cells.size());
  const TriangleMesh mesh = MeshOf(pieces);
  EXPECT_TRUE(FindMeshFaults(mesh).none());
}

TEST(Pieces, HolesAndInvertedBodiesAreFound) {
  Building building;
  BuildingParts(&building).Box("box", {0, 0, 0}, {1, 1, 1}, Material::kConcrete, 0.0);
  const std::vector<Cell> cells = {WholeCell(building.members[0], 0)};
  building.plan = {Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 1)};
  Snapshot snapshot;
  snapshot.cells.resize(1);
  TriangleMesh mesh = MeshOf(PiecesOf(building, cells, snapshot));
  EXPECT_TRUE(FindMeshFaults(mesh).none());
  TriangleMesh inverted = mesh;
  for (auto& triangle : inverted.triangles) std::swap(triangle[0], triangle[1]);
  EXPECT_EQ(FindMeshFaults(inverted).inverted_components, 1);
  EXPECT_EQ(FindMeshFaults(inverted).open_edges, 0);
  mesh.triangles.pop_back();
  EXPECT_EQ(FindMeshFaults(mesh).open_edges, 3);
}

TEST(Pieces, EveryFirstByteIsReadBack) {
  const test::TemporaryFolder folder;
  const std::string file = (folder.path() / "box.ply").string();
  // The lowest bytes of these floats are a line feed, a carriage return, a space, zero and 3.
  for (const std::uint32_t bits : {0xBCA3D70AU, 0x3F80000DU, 0x3F800020U, 0x3F800000U, 0x3F800003U}) {
    TriangleMesh mesh;
    mesh.vertices = {{std::bit_cast<float>(bits), 0, 0}, {2, 0, 0}, {0, 3, 0}, {0, 0, 4}};
    mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    WritePly(file, mesh);
    const TriangleMesh read = LoadMesh(file);
    EXPECT_EQ(read.vertices, mesh.vertices) << bits;
    EXPECT_EQ(read.triangles, mesh.triangles) << bits;
  }
}

}  // namespace
}  // namespace legopt::worldgen
