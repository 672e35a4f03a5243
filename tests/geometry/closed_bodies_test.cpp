#include <gtest/gtest.h>

#include <cmath>
#include <initializer_list>
#include <numbers>

#include "legopt/geometry/internal/mesh_bodies.h"
#include "legopt/geometry/internal/scene_solids.h"
#include "tests/folders.h"
#include "tests/geometry/test_shapes.h"

namespace legopt::test {
namespace {

using Eigen::Vector3d;

void AppendTo(const TriangleMesh& part, bool inside_out, TriangleMesh* mesh) {
  const int first = static_cast<int>(mesh->vertices.size());
  mesh->vertices.insert(mesh->vertices.end(), part.vertices.begin(), part.vertices.end());
  for (auto [a, b, c] : part.triangles) {
    if (inside_out) std::swap(b, c);
    mesh->triangles.push_back({first + a, first + b, first + c});
  }
}

TriangleMesh SolidBox(const Vector3d& size, const Eigen::Isometry3d& pose = Eigen::Isometry3d::Identity()) {
  return Tessellate(Spec(ShapeSpec::Kind::kBox, size, pose));
}

/// Returns the winding number computed independently: the solid angle of all triangles seen from a point, divided by 4
/// pi (van Oosterom and Strackee). NaN if one triangle fills half the view: the point lies in it, perhaps on a wall
/// between two bodies.
double WindingBySolidAngles(const TriangleMesh& mesh, const Vector3d& p) {
  constexpr double kHalfSolidAngle = 0.99 * std::numbers::pi;  // half of its solid angle
  double sum = 0.0;
  for (const auto& corners : mesh.triangles) {
    const Vector3d a = mesh.vertices[static_cast<size_t>(corners[0])] - p;
    const Vector3d b = mesh.vertices[static_cast<size_t>(corners[1])] - p;
    const Vector3d c = mesh.vertices[static_cast<size_t>(corners[2])] - p;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    const double half = std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    if (std::abs(half) > kHalfSolidAngle) return std::nan("");
    sum += half;
  }
  return sum / (2.0 * std::numbers::pi);
}

TEST(ClosedBodies, DepthIsTheDistanceToTheSurface) {
  const ClosedBodies box(SolidBox({2, 4, 6}));
  ASSERT_EQ(box.bodies().size(), 1U);
  EXPECT_EQ(box.vertices(box.bodies()[0]).size(), 8U);
  EXPECT_DOUBLE_EQ(box.Depth({0, 0, 0}), 1.0);
  EXPECT_NEAR(box.Depth({0.2, 1.9995, 0.1}), 0.0005, 1e-12);
  EXPECT_NEAR(box.Depth({0.9, -1.5, 2.8}), 0.1, 1e-12);
  for (const Vector3d& outside :
       {Vector3d(1.001, 0, 0), Vector3d(0, 0, 3.001), Vector3d(0, 0, -9), Vector3d(5, 5, 5)}) {
    EXPECT_EQ(box.Depth(outside), 0.0);
  }
}

// Crossing counts are error-prone for rays through vertices, along edges and within vertical faces.
TEST(ClosedBodies, RaysThroughEdgesAndVerticesCountLikeOthers) {
  constexpr int kCells = 8;
  TriangleMesh mesh;  // a tower: the vertices of each box are above those of the box below
  for (int i = 0; i < kCells; ++i) AppendTo(SolidBox({1, 1, 1}, At(0, 0, 1.5 * i)), false, &mesh);
  const ClosedBodies stack(mesh);
  EXPECT_EQ(stack.bodies().size(), static_cast<size_t>(kCells));
  for (const double x : {-0.5, -0.25, 0.0, 0.25, 0.5}) {
    for (const double y : {-0.5, -0.25, 0.0, 0.25, 0.5}) {
      const bool on_side = std::abs(x) == 0.5 || std::abs(y) == 0.5;
      for (int i = 0; i + 1 < kCells; ++i) {
        const double depth = stack.Depth({x, y, 1.5 * i + 0.125});
        EXPECT_EQ(depth > 1e-9, !on_side) << x << " " << y << " " << i;
        EXPECT_EQ(stack.Depth({x, y, 1.5 * i + 0.75}), 0.0) << x << " " << y << " between " << i << " and its next";
      }
    }
  }
}

TEST(ClosedBodies, WhatIsOpenHasNoInsideWhatIsInsideOutHas) {
  TriangleMesh open = SolidBox({1, 1, 1});
  open.triangles.pop_back();
  EXPECT_TRUE(ClosedBodies(open).bodies().empty());
  EXPECT_EQ(ClosedBodies(open).Depth({0, 0, 0}), 0.0);
  EXPECT_EQ(ClosedBodies({}).Depth({0, 0, 0}), 0.0);
  TriangleMesh turned;
  AppendTo(SolidBox({1, 1, 1}), true, &turned);
  EXPECT_DOUBLE_EQ(ClosedBodies(turned).Depth({0, 0, 0}), 0.5);
}

TEST(ClosedBodies, ACavityIsOutside) {
  TriangleMesh room = SolidBox({4, 4, 4});
  AppendTo(SolidBox({3, 3, 3}), true, &room);
  const ClosedBodies walls(room);
  EXPECT_EQ(walls.bodies().size(), 2U);
  EXPECT_EQ(walls.Depth({0, 0, 0}), 0.0);
  EXPECT_NEAR(walls.Depth({1.7, 0.1, 0.2}), 0.2, 1e-12);
}

TEST(ClosedBodies, AgreesWithSolidAnglesOnRandomHullsAndOnTheGarage) {
  Draw draw(5);
  TriangleMesh mesh;
  for (int i = 0; i < 12; ++i) {
    const ConvexHull hull = draw.RandomHull(40, {0.5, 0.5, 0.5});
    const Eigen::Isometry3d pose = draw.Pose(1.0);
    TriangleMesh part;
    for (const Vector3d& v : hull.vertices) part.vertices.push_back(pose * v);
    part.triangles = hull.triangles;
    AppendTo(part, false, &mesh);
  }
  const TriangleMesh garage = LoadMesh(SourceFolder() + "/data/garage-easier/scene.ply");
  int inside = 0;
  for (const TriangleMesh* which : std::initializer_list<const TriangleMesh*>{&mesh, &garage}) {
    const ClosedBodies bodies(*which);
    Eigen::AlignedBox3d bounds;
    for (const Vector3d& v : which->vertices) bounds.extend(v);
    for (int i = 0; i < 600; ++i) {
      Vector3d p = bounds.min() + 0.5 * (draw.Vector(1.0) + Vector3d::Ones()).cwiseProduct(bounds.sizes());
      // Every other point is exactly above or below a vertex.
      if (i % 2 == 0) p.head<2>() = which->vertices[static_cast<size_t>(i) * 7 % which->vertices.size()].head<2>();
      const double winding = WindingBySolidAngles(*which, p);
      const double depth = bodies.Depth(p);
      if (depth > 0.0 && depth < 1e-6) continue;                        // on a surface
      if (!(std::abs(winding - std::round(winding)) < 1e-3)) continue;  // too near to a surface for solid angles
      EXPECT_EQ(depth > 0.0, std::round(winding) != 0.0) << p.transpose() << ", winding number " << winding;
      inside += depth > 0.0 ? 1 : 0;
    }
  }
  EXPECT_GT(inside, 100);
}

}  // namespace
}  // namespace legopt::test
