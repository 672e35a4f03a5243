// Policy: exactness is proved, not sampled. A separated pair is certified by duality: the witness points lie in their
// shapes, and the reported normal separates the shapes by exactly the reported distance. A penetrating pair is
// compared with the exact minimum over all facet normals and all cross products of edges.
#include "legopt/geometry/internal/signed_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/geometry/test_shapes.h"

namespace legopt::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

PairDistance Distance(const PlacedShape& a, const PlacedShape& b) {
  PairDistance result;
  EXPECT_TRUE(SignedDistance(a.set(), b.set(), kBeyondAllDistances, result));
  EXPECT_NEAR(result.normal.norm(), 1.0, 1e-12);
  EXPECT_LT((result.point_a - result.point_b - result.distance_m * result.normal).norm(), 1e-12);
  return result;
}

PairDistance Distance(ConvexShape a, const Isometry3d& pose_a, ConvexShape b, const Isometry3d& pose_b) {
  return Distance(PlacedShape(std::move(a), pose_a), PlacedShape(std::move(b), pose_b));
}

/// Returns min over A of n.x - max over B of n.x, the gap along n; the distance is its maximum over n.
double Gap(const SupportSet& a, const SupportSet& b, const Vector3d& n) {
  return n.dot(a.Farthest(-n)) - a.radius - n.dot(b.Farthest(n)) - b.radius;
}

double BruteForceDepth(const ConvexHull& a, const Isometry3d& pose_a, const ConvexHull& b, const Isometry3d& pose_b,
                       const SupportSet& set_a, const SupportSet& set_b) {
  double depth = std::numeric_limits<double>::infinity();
  const auto consider = [&](const Vector3d& direction) {
    if (direction.norm() < 1e-9) return;
    const Vector3d n = direction.normalized();
    depth = std::min({depth, -Gap(set_a, set_b, n), -Gap(set_a, set_b, -n)});
  };
  for (const HalfSpace& f : a.facets) consider(pose_a.linear() * f.normal);
  for (const HalfSpace& f : b.facets) consider(pose_b.linear() * f.normal);
  const auto edges = [](const ConvexHull& hull, const Isometry3d& pose) {
    std::vector<Vector3d> result;
    for (const auto& t : hull.triangles) {
      for (size_t k = 0; k < 3; ++k) {
        if (t[k] < t[(k + 1) % 3]) {
          result.push_back(pose.linear() * (hull.vertices[static_cast<size_t>(t[(k + 1) % 3])] -
                                            hull.vertices[static_cast<size_t>(t[k])]));
        }
      }
    }
    return result;
  };
  for (const Vector3d& ea : edges(a, pose_a)) {
    for (const Vector3d& eb : edges(b, pose_b)) consider(ea.cross(eb));
  }
  return depth;
}

TEST(SignedDistance, BoxesApartFaceToFace) {
  const PairDistance d = Distance(Box(1, 1, 1), At(0, 0, 2), Box(2, 2, 1), At(0.3, 0.2, 0));
  EXPECT_NEAR(d.distance_m, 1.0, 1e-12);
  EXPECT_LT((d.normal - Vector3d::UnitZ()).norm(), 1e-9);
  EXPECT_NEAR(d.point_a.z(), 1.5, 1e-12);
  EXPECT_NEAR(d.point_b.z(), 0.5, 1e-12);
}

TEST(SignedDistance, BoxesApartCornerToCorner) {
  const PairDistance d = Distance(Box(1, 1, 1), At(2, 2, 2), Box(1, 1, 1), At(0, 0, 0));
  EXPECT_NEAR(d.distance_m, std::sqrt(3.0), 1e-12);
  EXPECT_LT((d.point_a - Vector3d(1.5, 1.5, 1.5)).norm(), 1e-12);
  EXPECT_LT((d.point_b - Vector3d(0.5, 0.5, 0.5)).norm(), 1e-12);
}

TEST(SignedDistance, BoxesPenetrateByTheShortestWayOut) {
  const PairDistance d = Distance(Box(0.2, 0.2, 0.2), At(0.1, 0.05, 0.55), Box(1, 1, 1), At(0, 0, 0));
  EXPECT_NEAR(d.distance_m, -0.05, 1e-9);
  EXPECT_LT((d.normal - Vector3d::UnitZ()).norm(), 1e-9);
  EXPECT_NEAR(d.point_a.z(), 0.45, 1e-9);
  EXPECT_NEAR(d.point_b.z(), 0.5, 1e-9);
}

TEST(SignedDistance, RotatedBoxOnItsEdge) {
  const Isometry3d tilted = At(0, 0, 1.0) * Eigen::AngleAxisd(M_PI / 4.0, Vector3d::UnitX());
  const PairDistance d = Distance(Box(1, 1, 1), tilted, Box(4, 4, 0.2), At(0, 0, 0));
  EXPECT_NEAR(d.distance_m, 1.0 - std::sqrt(0.5) - 0.1, 1e-9);
}

TEST(SignedDistance, SmallBoxDeepInsideAndConcentric) {
  const PairDistance inside = Distance(Box(0.1, 0.1, 0.1), At(0.2, 0, 0), Box(1, 1, 1), At(0, 0, 0));
  EXPECT_NEAR(inside.distance_m, -0.35, 1e-9);
  EXPECT_LT((inside.normal - Vector3d::UnitX()).norm(), 1e-9);
  const PairDistance same = Distance(Box(1, 1, 1), At(0, 0, 0), Box(1, 1, 1), At(0, 0, 0));
  EXPECT_NEAR(same.distance_m, -1.0, 1e-9);
}

TEST(SignedDistance, TouchingShapesHaveDistanceZeroAndAUsableNormal) {
  for (const double offset : {0.0, 1e-12, -1e-12, 1e-10, -1e-10}) {
    const PairDistance d = Distance(Box(1, 1, 1), At(0.1, 0.2, 1.0 + offset), Box(1, 1, 1), At(0, 0, 0));
    EXPECT_NEAR(d.distance_m, offset, 2e-9);
    EXPECT_LT((d.normal - Vector3d::UnitZ()).norm(), 1e-6) << offset;
  }
}

TEST(SignedDistance, SpheresAndCapsules) {
  EXPECT_NEAR(Distance(Sphere(0.5), At(2, 0, 0), Sphere(0.25), At(0, 0, 0)).distance_m, 1.25, 1e-12);
  const PairDistance overlap = Distance(Sphere(0.5), At(0.6, 0, 0), Sphere(0.25), At(0, 0, 0));
  EXPECT_NEAR(overlap.distance_m, -0.15, 1e-12);
  EXPECT_LT((overlap.normal - Vector3d::UnitX()).norm(), 1e-12);
  EXPECT_NEAR(Distance(Sphere(0.5), At(1, 2, 3), Sphere(0.25), At(1, 2, 3)).distance_m, -0.75, 1e-9);
  const Isometry3d across = At(0, 0, 0.3) * Eigen::AngleAxisd(M_PI / 2.0, Vector3d::UnitX());
  const Isometry3d along = At(0, 0, 0) * Eigen::AngleAxisd(M_PI / 2.0, Vector3d::UnitY());
  EXPECT_NEAR(Distance(Capsule(0.1, 1.0), across, Capsule(0.05, 1.0), along).distance_m, 0.15, 1e-12);
  const Isometry3d crossing = Isometry3d(Eigen::AngleAxisd(M_PI / 2.0, Vector3d::UnitX()));
  EXPECT_NEAR(Distance(Capsule(0.1, 1.0), crossing, Capsule(0.05, 1.0), along).distance_m, -0.15, 1e-9);
}

TEST(SignedDistance, CylinderAgainstBoxAndSphere) {
  EXPECT_NEAR(Distance(Cylinder(0.3, 1.0), At(1, 0, 0), Box(1, 1, 1), At(0, 0, 0)).distance_m, 0.2, 1e-7);
  EXPECT_NEAR(Distance(Cylinder(0.3, 1.0), At(0.7, 0, 0), Box(1, 1, 1), At(0, 0, 0)).distance_m, -0.1, 1e-7);
  EXPECT_NEAR(Distance(Cylinder(0.3, 1.0), At(0, 0, 0.9), Box(1, 1, 1), At(0, 0, 0)).distance_m, -0.1, 1e-7);
  // Nearest point on the rim of the cylinder.
  const double expected = std::hypot(0.4, 0.5) - 0.1;
  EXPECT_NEAR(Distance(Sphere(0.1), At(0.7, 0, 1.0), Cylinder(0.3, 1.0), At(0, 0, 0)).distance_m, expected, 1e-7);
}

TEST(SignedDistance, FlatAndDegenerateHulls) {
  const ConvexShape plate = Hull({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}});
  EXPECT_NEAR(Distance(Box(1, 1, 1), At(0, 0, 0.7), plate, At(0, 0, 0)).distance_m, 0.2, 1e-12);
  EXPECT_NEAR(Distance(Box(1, 1, 1), At(0, 0, 0.4), plate, At(0, 0, 0)).distance_m, -0.1, 1e-9);
  const ConvexShape needle = Hull({{0, 0, 0}, {0, 0, 1}});
  EXPECT_NEAR(Distance(needle, At(2, 0, 0), plate, At(0, 0, 0)).distance_m, 1.0, 1e-12);
  EXPECT_NEAR(Distance(needle, At(0, 0, -0.25), plate, At(0, 0, 0)).distance_m, -0.25, 1e-9);
  const ConvexShape point = Hull({{0, 0, 0}});
  EXPECT_NEAR(Distance(point, At(0, 0, 0), point, At(0, 3, 4)).distance_m, 5.0, 1e-12);
  EXPECT_NEAR(Distance(point, At(1, 1, 1), point, At(1, 1, 1)).distance_m, 0.0, 1e-9);
  EXPECT_NEAR(Distance(plate, At(0.5, 0, 0), plate, At(0, 0, 0)).distance_m, 0.0, 1e-9);  // coplanar
}

TEST(SignedDistance, CutoffIsExclusiveAndLeavesTheResultAlone) {
  PlacedShape a(Box(1, 1, 1), At(0, 0, 1.5));
  PlacedShape b(Box(1, 1, 1), At(0, 0, 0));
  PairDistance result;
  result.distance_m = 7.0;
  EXPECT_FALSE(SignedDistance(a.set(), b.set(), 0.49, result));
  EXPECT_EQ(result.distance_m, 7.0);
  EXPECT_TRUE(SignedDistance(a.set(), b.set(), 0.51, result));
  PlacedShape deep(Box(1, 1, 1), At(0, 0, 0.9));
  EXPECT_FALSE(SignedDistance(deep.set(), b.set(), -0.2, result));
  EXPECT_TRUE(SignedDistance(deep.set(), b.set(), -0.05, result));
}

TEST(SignedDistance, RandomHullsMeetTheirCertificates) {
  Draw draw(11);
  int apart = 0;
  int overlapping = 0;
  for (int round = 0; round < 2000; ++round) {
    const ConvexHull hull_a = draw.RandomHull(4 + round % 40, {0.3, 0.2, round % 7 == 0 ? 0.001 : 0.4});
    const ConvexHull hull_b = draw.RandomHull(4 + round % 13, {0.5, 0.4, 0.1});
    const Isometry3d pose_a = At(20, -30, 10) * draw.Pose(0.6);
    const Isometry3d pose_b = At(20, -30, 10) * draw.Pose(0.2);
    PlacedShape a(ConvexShape::FromHull(hull_a), pose_a);
    PlacedShape b(ConvexShape::FromHull(hull_b), pose_b);
    const PairDistance d = Distance(a, b);
    ASSERT_NEAR(Gap(a.set(), b.set(), d.normal), d.distance_m, 2e-9) << round;
    ASSERT_LT(hull_a.PlaneDistance(pose_a.inverse() * d.point_a), 2e-9) << round;
    ASSERT_LT(hull_b.PlaneDistance(pose_b.inverse() * d.point_b), 2e-9) << round;
    if (d.distance_m > 0.0) {
      ++apart;
    } else {
      ++overlapping;
      ASSERT_NEAR(-d.distance_m, BruteForceDepth(hull_a, pose_a, hull_b, pose_b, a.set(), b.set()), 2e-9) << round;
    }
  }
  EXPECT_GT(apart, 300);
  EXPECT_GT(overlapping, 300);
}

TEST(SignedDistance, SwappingTheShapesMirrorsTheResult) {
  Draw draw(12);
  for (int round = 0; round < 500; ++round) {
    PlacedShape a(ConvexShape::FromHull(draw.RandomHull(20, {0.3, 0.3, 0.3})), draw.Pose(0.5));
    PlacedShape b(ConvexShape::FromHull(draw.RandomHull(20, {0.3, 0.3, 0.3})), draw.Pose(0.5));
    const PairDistance ab = Distance(a, b);
    const PairDistance ba = Distance(b, a);
    ASSERT_NEAR(ab.distance_m, ba.distance_m, 2e-9);
    ASSERT_LT((ab.normal + ba.normal).norm(), 1e-5) << round;
  }
}

TEST(SignedDistance, MovingBothShapesTogetherChangesNothing) {
  Draw draw(13);
  for (int round = 0; round < 500; ++round) {
    const ConvexHull hull_a = draw.RandomHull(24, {0.3, 0.3, 0.3});
    const ConvexHull hull_b = draw.RandomHull(12, {0.3, 0.3, 0.3});
    const Isometry3d pose_a = draw.Pose(0.5);
    const Isometry3d pose_b = draw.Pose(0.5);
    const Isometry3d motion = draw.Pose(3.0);
    const PairDistance before = Distance(ConvexShape::FromHull(hull_a), pose_a, ConvexShape::FromHull(hull_b), pose_b);
    const PairDistance after =
        Distance(ConvexShape::FromHull(hull_a), motion * pose_a, ConvexShape::FromHull(hull_b), motion * pose_b);
    ASSERT_NEAR(before.distance_m, after.distance_m, 2e-9);
    ASSERT_LT((motion.linear() * before.normal - after.normal).norm(), 1e-5) << round;
  }
}

/// Moves two shapes past each other with hints from the previous pose; every seventh pose is far from the previous
/// one.
void ExpectHintsChangeNothing(const ConvexShape& a, const ConvexShape& b, double tolerance_m, Draw& draw) {
  DistanceHint hint;
  Isometry3d pose = draw.Pose(0.6);
  const PlacedShape fixed(b, Isometry3d::Identity());
  for (int step = 0; step < 70; ++step) {
    const Isometry3d turn(Eigen::AngleAxisd(draw.Number(-0.05, 0.05), draw.Vector(1.0).normalized()));
    pose = step % 7 == 0 ? draw.Pose(0.6)
                         : Eigen::Translation3d(draw.Number(0.0, 0.01) * draw.Vector(1.0).normalized()) * pose * turn;
    const PlacedShape moving(a, pose);
    for (const double cutoff : {0.05, kBeyondAllDistances}) {
      PairDistance cold, warm;
      const bool found = SignedDistance(moving.set(), fixed.set(), cutoff, cold);
      ASSERT_EQ(SignedDistance(moving.set(), fixed.set(), cutoff, warm, &hint), found) << step;
      if (!found) continue;
      EXPECT_NEAR(warm.distance_m, cold.distance_m, tolerance_m) << step;
      EXPECT_LT((warm.point_a - warm.point_b - warm.distance_m * warm.normal).norm(), 1e-12);
      // The normal proves the distance, even if it is one of several.
      EXPECT_NEAR(Gap(moving.set(), fixed.set(), warm.normal), warm.distance_m, tolerance_m) << step;
    }
  }
}

TEST(SignedDistance, HintsChangeNothing) {
  Draw draw(47);
  const auto hull = [&](int points, double size) {
    return ConvexShape::FromHull(draw.RandomHull(points, Vector3d::Constant(size)));
  };
  for (int round = 0; round < 20; ++round) {
    ExpectHintsChangeNothing(hull(30, 0.2), hull(12, 0.3), 2e-9, draw);
    ExpectHintsChangeNothing(Box(0.3, 0.2, 0.1), Box(1.0, 1.0, 0.2), 2e-9, draw);
    ExpectHintsChangeNothing(Capsule(0.05, 0.3), hull(12, 0.3), 2e-9, draw);
    ExpectHintsChangeNothing(Box(0.3, 0.2, 0.1), Cylinder(0.2, 0.4), 5e-7, draw);
    ExpectHintsChangeNothing(hull(30, 0.2), Sphere(0.2), 2e-9, draw);
  }
}

TEST(SignedDistance, ManyTouchingBoxesStayExact) {
  // Axis-aligned boxes have many ties: parallel faces, coplanar corners, equal supports.
  Draw draw(14);
  for (int round = 0; round < 2000; ++round) {
    const auto step = [&] { return std::round(draw.Number(-3.0, 3.0)) * 0.25; };
    const Vector3d offset(step(), step(), step());
    const PairDistance d =
        Distance(Box(1, 1, 1), At(offset.x(), offset.y(), offset.z()), Box(0.5, 0.5, 0.5), At(0, 0, 0));
    const Vector3d gap = offset.cwiseAbs().array() - 0.75;
    const double expected = gap.maxCoeff() <= 0.0 ? gap.maxCoeff() : gap.cwiseMax(0.0).norm();
    ASSERT_NEAR(d.distance_m, expected, 2e-9) << offset.transpose();
  }
}

TEST(SignedDistance, CylindersMeetTheirCertificates) {
  Draw draw(15);
  for (int round = 0; round < 1000; ++round) {
    PlacedShape a(Cylinder(0.2, 0.5), draw.Pose(0.5));
    PlacedShape b(round % 2 == 0 ? Cylinder(0.1, 0.7) : Box(0.3, 0.2, 0.5), draw.Pose(0.5));
    const PairDistance d = Distance(a, b);
    ASSERT_NEAR(Gap(a.set(), b.set(), d.normal), d.distance_m, 1e-6) << round;
    if (d.distance_m > 0.0) continue;
    for (int sample = 0; sample < 200; ++sample) {
      const Vector3d n = draw.Vector(1.0).normalized();
      ASSERT_LE(Gap(a.set(), b.set(), n), d.distance_m + 1e-6) << round;  // no direction separates by a shorter
                                                                          // translation
    }
  }
}

}  // namespace
}  // namespace legopt::test
