#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "legopt/geometry/internal/convex_decomposition.h"
#include "legopt/geometry/internal/convex_shape.h"
#include "legopt/geometry/internal/mesh_bodies.h"
#include "legopt/geometry/internal/scene_solids.h"
#include "tests/geometry/test_shapes.h"

namespace legopt::test {
namespace {

TriangleMesh BoxMesh(const Eigen::Vector3d& size, const Eigen::Isometry3d& pose) {
  return Tessellate(Spec(ShapeSpec::Kind::kBox, size, pose));
}

/// Appends a mesh and merges identical vertices, as in a mesh file.
void Append(TriangleMesh& mesh, const TriangleMesh& part) {
  for (const auto& t : part.triangles) {
    std::array<int, 3> corners{};
    for (size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d& p = part.vertices[static_cast<size_t>(t[k])];
      const auto it = std::find(mesh.vertices.begin(), mesh.vertices.end(), p);
      corners[k] = static_cast<int>(it - mesh.vertices.begin());
      if (it == mesh.vertices.end()) mesh.vertices.push_back(p);
    }
    mesh.triangles.push_back(corners);
  }
}

/// Returns a vertical prism over a triangulated plan polygon, between z = 0 and z = height.
TriangleMesh Extrude(const std::vector<Eigen::Vector2d>& plan, const std::vector<std::array<int, 3>>& triangles,
                     const std::vector<int>& outline, double height) {
  TriangleMesh mesh;
  const int n = static_cast<int>(plan.size());
  for (const double z : {0.0, height}) {
    for (const auto& p : plan) mesh.vertices.emplace_back(p.x(), p.y(), z);
  }
  for (const auto& t : triangles) {
    mesh.triangles.push_back({t[0] + n, t[1] + n, t[2] + n});
    mesh.triangles.push_back({t[0], t[2], t[1]});
  }
  for (size_t k = 0; k < outline.size(); ++k) {
    const int a = outline[k];
    const int b = outline[(k + 1) % outline.size()];
    mesh.triangles.push_back({a, b, b + n});
    mesh.triangles.push_back({a, b + n, a + n});
  }
  return mesh;
}

/// Returns an L in plan: 2 x 2 without its upper right quarter.
TriangleMesh LPrism() {
  return Extrude({{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}}, {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}},
                 {0, 1, 2, 3, 4, 5}, 0.5);
}

double TotalVolume(const std::vector<ConvexHull>& hulls) {
  return std::accumulate(hulls.begin(), hulls.end(), 0.0, [](double sum, const auto& h) { return sum + h.volume_m3; });
}

TEST(Hull, CubeWithInnerPoints) {
  Draw draw(1);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 200; ++i) points.push_back(Eigen::Vector3d(100, 200, 300) + draw.Vector(0.49));
  for (int i = 0; i < 8; ++i) {
    points.push_back(Eigen::Vector3d(100, 200, 300) +
                     Eigen::Vector3d(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5));
  }
  const ConvexHull hull = ComputeHull(points);
  EXPECT_EQ(hull.vertices.size(), 8U);
  EXPECT_EQ(hull.triangles.size(), 12U);
  EXPECT_NEAR(hull.volume_m3, 1.0, 1e-9);
  EXPECT_NEAR(hull.PlaneDistance({100, 200, 300}), -0.5, 1e-9);
  EXPECT_NEAR(hull.PlaneDistance({100, 200, 301}), 0.5, 1e-9);
}

TEST(Hull, FlatSetsKeepTheirExtremePoints) {
  const ConvexHull square =
      ComputeHull(std::vector<Eigen::Vector3d>{{0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}, {0.5, 0.5, 1}, {0.5, 0, 1}});
  EXPECT_TRUE(square.flat());
  EXPECT_EQ(square.vertices.size(), 4U);
  const ConvexHull line =
      ComputeHull(std::vector<Eigen::Vector3d>{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}, {1.5, 1.5, 1.5}});
  EXPECT_EQ(line.vertices.size(), 2U);
  EXPECT_EQ(ComputeHull(std::vector<Eigen::Vector3d>(5, Eigen::Vector3d(1, 2, 3))).vertices.size(), 1U);
}

TEST(Components, TouchingBoxesAreTakenApart) {
  TriangleMesh mesh;
  // Two share a face, which exists twice, a third shares an edge with the first, and a fourth only a corner.
  Append(mesh, BoxMesh({1, 1, 1}, At(0, 0, 0)));
  Append(mesh, BoxMesh({1, 1, 1}, At(1, 0, 0)));
  Append(mesh, BoxMesh({1, 1, 1}, At(-1, 1, 0)));
  Append(mesh, BoxMesh({1, 1, 1}, At(-1, -1, -1)));
  const std::vector<TriangleMesh> parts = SplitIntoComponents(mesh);
  ASSERT_EQ(parts.size(), 4U);
  for (const TriangleMesh& part : parts) {
    EXPECT_EQ(part.triangles.size(), 12U);
    EXPECT_EQ(part.vertices.size(), 8U);
    EXPECT_NEAR(ComputeHull(part.vertices).volume_m3, 1.0, 1e-9);
  }
}

TEST(Components, OpenAndInsideOutSurfacesStayTogether) {
  TriangleMesh mesh = BoxMesh({1, 1, 1}, At(0, 0, 0));
  mesh.triangles.pop_back();
  std::swap(mesh.triangles[3][0], mesh.triangles[3][1]);
  EXPECT_EQ(SplitIntoComponents(mesh).size(), 1U);
}

TEST(Prism, LShapeIsRecognisedAndCutIntoTwoExactPieces) {
  const auto prism = RecogniseVerticalPrism(LPrism());
  ASSERT_TRUE(prism.has_value());
  const auto pieces = CutIntoConvexPrisms({*prism});
  EXPECT_EQ(pieces.size(), 2U);
  double volume = 0.0;
  for (const auto& piece : pieces) volume += ComputeHull(piece).volume_m3;
  EXPECT_NEAR(volume, 1.5, 1e-9);
}

TEST(Prism, TiltedSurfacesAreKept) {
  TriangleMesh mesh = LPrism();
  for (Eigen::Vector3d& v : mesh.vertices) v.z() += 0.1 * v.x() - 0.2 * v.y();
  const auto prism = RecogniseVerticalPrism(mesh);
  ASSERT_TRUE(prism.has_value());
  EXPECT_LT((prism->top - Eigen::Vector3d(0.5, 0.1, -0.2)).norm(), 1e-9);
  EXPECT_LT((prism->bottom - Eigen::Vector3d(0.0, 0.1, -0.2)).norm(), 1e-9);
}

TEST(Prism, NeighboursWithTheSamePlanesGrowTogether) {
  const auto left = RecogniseVerticalPrism(BoxMesh({1, 1, 1}, At(0, 0, 0)));
  const auto right = RecogniseVerticalPrism(BoxMesh({1, 1, 1}, At(1, 0, 0)));
  const auto lower = RecogniseVerticalPrism(BoxMesh({1, 1, 1}, At(2, 0, -0.01)));
  ASSERT_TRUE(left && right && lower);
  EXPECT_EQ(CutIntoConvexPrisms({*left, *right, *lower}).size(), 2U);
}

TEST(Prism, OtherShapesAreRefused) {
  const Eigen::Isometry3d tilted(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()));
  EXPECT_FALSE(RecogniseVerticalPrism(BoxMesh({1, 1, 1}, tilted)).has_value());
  EXPECT_FALSE(RecogniseVerticalPrism(Tessellate(Spec(ShapeSpec::Kind::kSphere, {1, 0, 0}))).has_value());
}

TEST(Decomposition, ConvexMeshStaysWhole) {
  const TriangleMesh sphere = Tessellate(Spec(ShapeSpec::Kind::kSphere, {1, 0, 0}));
  EXPECT_TRUE(IsConvex(sphere, ComputeHull(sphere.vertices)));
  EXPECT_EQ(DecomposeApproximately(sphere, {0.01, 16}).size(), 1U);
  EXPECT_FALSE(IsConvex(LPrism(), ComputeHull(LPrism().vertices)));
}

TEST(Decomposition, PiecesContainTheMeshAndApproachIt) {
  TriangleMesh cross;  // three bars through the origin
  Append(cross, BoxMesh({2, 0.2, 0.2}, At(0, 0, 0)));
  Append(cross, BoxMesh({0.2, 2, 0.2}, At(0, 0, 0)));
  Append(cross, BoxMesh({0.2, 0.2, 2}, At(0, 0, 0)));
  const std::vector<ConvexHull> pieces = DecomposeApproximately(cross, {0.05, 32});
  const double hull_volume = ComputeHull(cross.vertices).volume_m3;
  EXPECT_GT(pieces.size(), 4U);
  EXPECT_LE(pieces.size(), 32U);
  EXPECT_LT(TotalVolume(pieces), 0.4 * hull_volume);
  Draw draw(3);
  for (const auto& t : cross.triangles) {
    for (int sample = 0; sample < 50; ++sample) {
      double u = draw.Number(0, 1);
      double v = draw.Number(0, 1);
      if (u + v > 1.0) std::tie(u, v) = std::pair(1.0 - u, 1.0 - v);
      const auto at = [&](size_t k) { return cross.vertices[static_cast<size_t>(t[k])]; };
      const Eigen::Vector3d p = at(0) + u * (at(1) - at(0)) + v * (at(2) - at(0));
      EXPECT_TRUE(std::any_of(pieces.begin(), pieces.end(), [&](const auto& h) { return h.PlaneDistance(p) < 1e-9; }));
    }
  }
}

/// Divides every triangle into four, `times` times.
TriangleMesh Refined(TriangleMesh mesh, int times) {
  for (int i = 0; i < times; ++i) {
    TriangleMesh finer{.vertices = mesh.vertices, .triangles = {}};
    for (const auto& [a, b, c] : mesh.triangles) {
      const int first = static_cast<int>(finer.vertices.size());
      const auto middle = [&](int from, int to) {
        finer.vertices.emplace_back(
            0.5 * (mesh.vertices[static_cast<size_t>(from)] + mesh.vertices[static_cast<size_t>(to)]));
      };
      middle(a, b);
      middle(b, c);
      middle(c, a);
      const int ab = first, bc = first + 1, ca = first + 2;
      for (const auto& t : {std::array{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}})
        finer.triangles.push_back(t);
    }
    mesh = std::move(finer);
  }
  return mesh;
}

TEST(Decomposition, CutsChosenOnASampleContainTheWholeMesh) {
  TriangleMesh cross;
  Append(cross, BoxMesh({2, 0.2, 0.2}, At(0, 0, 0)));
  Append(cross, BoxMesh({0.2, 2, 0.2}, At(0, 0, 0)));
  const TriangleMesh fine = Refined(cross, 4);
  ASSERT_GT(fine.triangles.size(), 5'000U);
  const std::vector<ConvexHull> pieces = DecomposeBySample(fine, {0.05, 8}, 1'000);
  EXPECT_GT(pieces.size(), 1U);
  EXPECT_LE(pieces.size(), 8U);
  EXPECT_LT(TotalVolume(pieces), 0.6 * ComputeHull(fine.vertices).volume_m3);
  for (const Eigen::Vector3d& vertex : fine.vertices) {
    EXPECT_TRUE(std::ranges::any_of(pieces, [&](const ConvexHull& h) { return h.PlaneDistance(vertex) < 1e-9; }));
  }
}

TEST(Decomposition, ASmallMeshIsItsOwnSample) {
  TriangleMesh cross;
  Append(cross, BoxMesh({2, 0.2, 0.2}, At(0, 0, 0)));
  Append(cross, BoxMesh({0.2, 2, 0.2}, At(0, 0, 0)));
  const auto all = DecomposeApproximately(cross, {0.05, 8});
  const auto sampled = DecomposeBySample(cross, {0.05, 8});
  ASSERT_EQ(all.size(), sampled.size());
  for (size_t i = 0; i < all.size(); ++i) EXPECT_EQ(all[i].vertices, sampled[i].vertices);
}

// Another plate may be between two plates; a piece around both would block it.
TEST(Decomposition, NoPieceBridgesTwoBodies) {
  TriangleMesh plates;
  for (const double z : {-0.05, 0.05}) Append(plates, BoxMesh({0.4, 0.4, 0.02}, At(0, 0, z)));
  constexpr DecompositionLimits kLimits{0.2, 8};  // coarser than the gap
  ASSERT_EQ(DecomposeApproximately(plates, kLimits).size(), 1U);
  const std::vector<ConvexHull> pieces = DecomposeBodies(plates, kLimits);
  ASSERT_EQ(pieces.size(), 2U);
  for (const ConvexHull& piece : pieces) EXPECT_GT(piece.PlaneDistance(Eigen::Vector3d::Zero()), 0.03);
}

TEST(Decomposition, PieceLimitAndRepeatabilityHold) {
  TriangleMesh cross;
  Append(cross, BoxMesh({2, 0.2, 0.2}, At(0, 0, 0)));
  Append(cross, BoxMesh({0.2, 2, 0.2}, At(0, 0, 0)));
  const auto first = DecomposeApproximately(cross, {0.001, 3});
  const auto second = DecomposeApproximately(cross, {0.001, 3});
  EXPECT_LE(first.size(), 3U);
  ASSERT_EQ(first.size(), second.size());
  for (size_t i = 0; i < first.size(); ++i) EXPECT_EQ(first[i].vertices, second[i].vertices);
}

TEST(SceneSolids, CopiesOfAShapeShareOneDecomposition) {
  const auto bars = [](const Eigen::Isometry3d& pose) {
    TriangleMesh mesh = LPrism();
    for (Eigen::Vector3d& v : mesh.vertices) v = pose * v;
    return mesh;
  };
  // Tilted, so that it is not a vertical prism and must be decomposed; the second is the first moved.
  const Eigen::Isometry3d tilt(Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 1, 0).normalized()));
  TriangleMesh mesh = bars(tilt);
  const size_t alone = SolidsOfMesh(mesh, {}).size();
  const TriangleMesh moved = bars(At(5, 1, 2) * Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitZ()) * tilt);
  Append(mesh, moved);
  const std::vector<ConvexShape> solids = SolidsOfMesh(mesh, {});
  ASSERT_EQ(solids.size(), 2 * alone);
  EXPECT_GT(alone, 1U);
  for (const Eigen::Vector3d& v : moved.vertices) {
    EXPECT_TRUE(std::any_of(solids.begin(), solids.end(), [&](const auto& s) { return s.BoundaryDistance(v) < 1e-6; }));
  }
}

}  // namespace
}  // namespace legopt::test
