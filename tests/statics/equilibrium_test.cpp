// Equilibrium polygons and imbalances against independent formulations, on random and on degenerate stances.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "legopt/dataset/contact.h"
#include "legopt/statics/equilibrium_polygon.h"
#include "legopt/statics/internal/position_program.h"
#include "legopt/statics/stance_forces.h"
#include "legopt/statics/static_equilibrium.h"
#include "tests/statics/exact_program.h"
#include "tests/statics/least_squares.h"
#include "tests/statics/random_stances.h"
#include "tests/statics/reference_program.h"

namespace legopt {
namespace {

RobotModel Stone() {
  Link link;
  link.name = "stone";
  link.mass = 10.0;
  return RobotModel("stone", {link}, {});
}

TouchedSurface Patch(const Eigen::Matrix3d& axes_W, const Eigen::Vector3d& centre, double friction, double half = 0.1) {
  TouchedSurface surface;
  surface.axes_W = axes_W;
  surface.friction = friction;
  for (const double x : {-half, half}) {
    for (const double y : {-half, half}) surface.points_W.emplace_back(centre + axes_W * Eigen::Vector3d(x, y, 0));
  }
  return surface;
}

Eigen::Matrix3d Tilted(double angle_rad, double heading_rad = 0.0) {
  return (Eigen::AngleAxisd(heading_rad, Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitY()))
      .toRotationMatrix();
}

/// Residual of the balance at a centre of mass, where a push (weights) acts, by non-negative least squares; 0:
/// equilibrium.
double LeastSquaresResidual(const StanceForces& forces, const Eigen::Vector3d& com_W,
                            const Eigen::Vector2d& push = Eigen::Vector2d::Zero()) {
  Eigen::MatrixXd A(6, forces.num_generators());
  for (int l = 0; l < forces.num_generators(); ++l) {
    const Eigen::Vector3d position_W = forces.points()[static_cast<size_t>(forces.point_of(l))].position_W;
    A.col(l) << forces.directions().col(l), (position_W - com_W).cross(forces.directions().col(l));
  }
  Eigen::VectorXd b = Eigen::VectorXd::Zero(6);
  b.head<3>() << -push, 1.0;
  return test::NonNegativeResidual(A, b);
}

TEST(EquilibriumPolygon, OfLevelGroundIsTheHullOfThePoints) {
  const StanceForces forces({Patch(Tilted(0), {0, 0.2, 0}, 0.5), Patch(Tilted(0), {0, -0.2, 0}, 0.5)});
  const std::vector<Eigen::Vector2d> corners = ComputeEquilibriumPolygon(forces).corners;
  EXPECT_NEAR(PolygonArea(corners), 0.2 * 0.6, 1e-9);
  for (const Eigen::Vector2d& corner : corners)
    EXPECT_LT((corner.cwiseAbs() - Eigen::Vector2d(0.1, 0.3)).maxCoeff(), 1e-9);
}

TEST(EquilibriumPolygon, OfAPointIsAPointAndOfTwoASegment) {
  TouchedSurface surface;
  surface.friction = 0.5;
  surface.points_W = {{0.3, 0.2, 0.1}};
  const std::vector<Eigen::Vector2d> point = ComputeEquilibriumPolygon(StanceForces({surface})).corners;
  ASSERT_EQ(point.size(), 1u);
  EXPECT_LT((point[0] - Eigen::Vector2d(0.3, 0.2)).norm(), 1e-9);
  surface.points_W.emplace_back(0.5, 0.6, 0.1);
  const std::vector<Eigen::Vector2d> segment = ComputeEquilibriumPolygon(StanceForces({surface})).corners;
  ASSERT_EQ(segment.size(), 2u);
  EXPECT_NEAR((segment[0] - segment[1]).norm(), std::hypot(0.2, 0.4), 1e-9);
}

TEST(EquilibriumPolygon, IsEmptyOnASlopeSteeperThanFriction) {
  const double friction = 0.5, limit_rad = std::atan(friction);
  const StanceForces holds({Patch(Tilted(limit_rad - 1e-3), {0, 0, 0}, friction)});
  EXPECT_FALSE(ComputeEquilibriumPolygon(holds).corners.empty());
  const StanceForces slides({Patch(Tilted(limit_rad + 5e-3), {0, 0, 0}, friction)});
  const EquilibriumPolygon polygon = ComputeEquilibriumPolygon(slides);
  EXPECT_TRUE(polygon.corners.empty());
  ASSERT_TRUE(polygon.slide);
  EXPECT_TRUE(IsProof(CheckedProof(slides, polygon.slide->direction, polygon.slide->turn)));
  EXPECT_LT(-polygon.slide->direction.z(), 0.0) << "downwards";
  EXPECT_GT(-polygon.slide->direction.x(), 0.0) << "a slope about +y descends along +x";
}

TEST(EquilibriumPolygon, ProofsAreOfTheChosenPyramid) {
  // Between edges, the inscribed pyramid loses 1 - cos(pi / 8) of the friction.
  const double friction = 0.5, between = std::numbers::pi / kPyramidEdges;
  const double angle_rad = std::atan(friction * 0.96);
  const Eigen::Matrix3d axes_W = Tilted(angle_rad) * Eigen::AngleAxisd(between, Eigen::Vector3d::UnitZ());
  const TouchedSurface surface = Patch(axes_W, {0, 0, 0}, friction);
  EXPECT_TRUE(ComputeEquilibriumPolygon(StanceForces({surface}, FrictionPyramid::kInscribed)).corners.empty());
  EXPECT_FALSE(ComputeEquilibriumPolygon(StanceForces({surface}, FrictionPyramid::kCircumscribed)).corners.empty());
}

TEST(EquilibriumPolygon, OfOppositeWallsEndsAtItsReach) {
  const double right = std::numbers::pi / 2.0;
  const StanceForces forces({Patch(Tilted(right), {-0.5, 0, 0.5}, 0.8), Patch(Tilted(-right), {0.5, 0, 0.5}, 0.8)});
  for (const Eigen::Vector2d& corner : ComputeEquilibriumPolygon(forces).corners) {
    EXPECT_LE(corner.cwiseAbs().maxCoeff(), kPolygonReach_m + 1e-6);
  }
}

TEST(EquilibriumPolygon, ContainsAllThatTheCentreOfMassOfALargeRobotCanReach) {
  const double right = std::numbers::pi / 2.0;
  std::vector<TouchedSurface> walls = {Patch(Tilted(right), {-0.5, 0, 0.5}, 0.8),
                                       Patch(Tilted(-right), {0.5, 0, 0.5}, 0.8)};
  const auto reach = [&] {
    double largest = 0.0;
    for (const Eigen::Vector2d& corner : ComputeEquilibriumPolygon(StanceForces(walls)).corners) {
      largest = std::max(largest, corner.cwiseAbs().maxCoeff());
    }
    return largest;
  };
  EXPECT_NEAR(reach(), kPolygonReach_m, 1e-6);
  walls[0].com_reach_m = 2.0;
  EXPECT_NEAR(reach(), kPolygonReach_m, 1e-6);
  walls[1].com_reach_m = 7.5;
  EXPECT_NEAR(reach(), 7.5, 1e-6);
  walls[0].com_reach_m = std::numeric_limits<double>::infinity();
  EXPECT_NEAR(reach(), kPolygonReach_m, 1e-6) << "not known";
}

TEST(PositionProgram, TurningAndSearchingFindTheSamePolygon) {
  constexpr int kStances = 400;
  std::mt19937_64 random(11);
  int compared = 0;
  for (int trial = 0; trial < kStances; ++trial) {
    const StanceForces forces(trial % 2 == 0 ? test::RandomSurfacesAndBars(random) : test::DegenerateSurfaces(random));
    PositionProgram program(forces, Eigen::Vector3d::UnitZ());
    if (program.status() != LinearProgramStatus::kOptimal) continue;
    const std::vector<Eigen::Vector2d> turned = program.TurnedCorners();
    const std::vector<Eigen::Vector2d> searched = program.SearchedCorners(kPolygonAccuracy_m);
    ASSERT_FALSE(turned.empty()) << trial;
    ASSERT_FALSE(searched.empty()) << trial;
    for (int k = 0; k < 32; ++k) {
      const Eigen::Vector2d direction = Eigen::Rotation2Dd(2.0 * std::numbers::pi * k / 32) * Eigen::Vector2d::UnitX();
      const auto furthest = [&](const std::vector<Eigen::Vector2d>& corners) {
        double most = -std::numeric_limits<double>::infinity();
        for (const Eigen::Vector2d& corner : corners) most = std::max(most, direction.dot(corner));
        return most;
      };
      EXPECT_NEAR(furthest(turned), furthest(searched), kPolygonAccuracy_m) << trial << ", direction " << k;
    }
    ++compared;
  }
  EXPECT_GT(compared, kStances / 4);
}

TEST(IsUnbounded, WhereContactsWithoutBoundPressAgainstEachOther) {
  const auto slopes = [](double tilt_rad, double friction) {
    return std::vector<TouchedSurface>{Patch(Tilted(tilt_rad), {-0.5, 0, 0.5}, friction),
                                       Patch(Tilted(-tilt_rad), {0.5, 0, 0.5}, friction)};
  };
  const double right = std::numbers::pi / 2.0, steep = std::numbers::pi / 3.0;  // cot(60 deg) = 0.577
  EXPECT_TRUE(IsUnbounded(StanceForces(slopes(right, 0.8))));
  EXPECT_TRUE(IsUnbounded(StanceForces(slopes(steep, 0.6))));
  EXPECT_FALSE(IsUnbounded(StanceForces(slopes(steep, 0.55)))) << "the cones do not contain the horizontal";
  EXPECT_FALSE(IsUnbounded(StanceForces(slopes(0.0, 0.8))));
  EXPECT_FALSE(IsUnbounded(StanceForces({})));

  std::vector<TouchedSurface> walls = slopes(right, 0.8);
  walls[0].max_normal = 2.0;
  EXPECT_FALSE(IsUnbounded(StanceForces(walls)));
  walls[0].max_normal.reset();
  walls[0].max_component = 2.0;
  EXPECT_FALSE(IsUnbounded(StanceForces(walls))) << "a bar";
  walls = slopes(right, 0.8);
  walls.push_back(Patch(Tilted(0), {0, 0, 0}, 0.5));
  EXPECT_TRUE(IsUnbounded(StanceForces(walls)));
}

TEST(IsUnbounded, AgreesWithThePolygonOfRandomStances) {
  std::mt19937_64 random(29);
  int unbounded = 0;
  for (int trial = 0; trial < 400; ++trial) {
    std::vector<TouchedSurface> surfaces = test::RandomSurfaces(random);
    constexpr double kFar_m = 1e3;
    surfaces.front().com_reach_m = kFar_m;
    const StanceForces forces(surfaces);
    double reach_m = 0.0;
    for (const Eigen::Vector2d& corner : ComputeEquilibriumPolygon(forces).corners) {
      reach_m = std::max(reach_m, (corner - forces.origin_W().head<2>()).cwiseAbs().maxCoeff());
    }
    const bool ends_at_reach = reach_m > kFar_m - 1.0;
    EXPECT_EQ(IsUnbounded(forces), ends_at_reach) << trial << ": " << reach_m;
    unbounded += ends_at_reach ? 1 : 0;
  }
  EXPECT_GT(unbounded, 10);
}

TEST(EquilibriumPolygon, BoundedNormalForcesShrinkIt) {
  TouchedSurface hand = Patch(Tilted(0), {1.0, 0, 0.5}, 0.5, 0.02);
  const TouchedSurface foot = Patch(Tilted(0), {0, 0, 0}, 0.5);
  const auto reach = [&] {
    double largest = 0.0;
    for (const Eigen::Vector2d& corner : ComputeEquilibriumPolygon(StanceForces({foot, hand})).corners) {
      largest = std::max(largest, corner.x());
    }
    return largest;
  };
  EXPECT_NEAR(reach(), 1.02, 1e-3);
  hand.max_normal = 0.25;
  // A quarter of the weight on the hand's front edge, the rest on the foot's, and no horizontal forces to speak of:
  // these can carry a little more by friction at different heights.
  EXPECT_LT(reach(), 0.25 * 1.02 + 0.75 * 0.1 + 0.5 * 0.25 * 0.5 + 1e-3);
  EXPECT_GT(reach(), 0.25 * 1.02 + 0.75 * 0.1 - 1e-3);
}

TEST(EquilibriumPolygon, AgreesWithLeastSquaresOnRandomStances) {
  std::mt19937_64 random(11);
  int inside = 0, outside = 0, empty = 0, proven = 0;
  for (int trial = 0; trial < 10'000; ++trial) {
    SCOPED_TRACE(trial);
    std::vector<TouchedSurface> surfaces = test::RandomSurfaces(random);
    for (TouchedSurface& surface : surfaces) surface.max_normal.reset();  // least squares have no bounds
    const StanceForces forces(surfaces);
    const Eigen::Vector3d com_W = test::RandomCom(surfaces, random);
    const EquilibriumPolygon polygon = ComputeEquilibriumPolygon(forces);
    const double residual = LeastSquaresResidual(forces, com_W);
    if (polygon.corners.empty()) {
      EXPECT_GT(residual, 1e-6);
      proven += polygon.slide && IsProof(CheckedProof(forces, polygon.slide->direction, polygon.slide->turn)) ? 1 : 0;
      ++empty;
      continue;
    }
    const double distance = SignedDistanceToPolygon(polygon.corners, com_W.head<2>());
    if (distance < 0.0) {
      EXPECT_LT(residual, 1e-9) << distance;  // every inner point has forces
      ++inside;
    } else if (distance > 2.0 * kPolygonAccuracy_m &&
               (com_W - forces.origin_W()).head<2>().cwiseAbs().maxCoeff() < 2.9) {
      EXPECT_GT(residual, 1e-9) << distance;
      ++outside;
    }
  }
  EXPECT_GT(inside, 1'000);
  EXPECT_GT(outside, 1'000);
  EXPECT_GT(empty, 1'000);
  EXPECT_GT(proven, empty * 9 / 10);
}

TEST(EquilibriumPolygon, WithAPushAgreesWithLeastSquaresOnRandomStances) {
  std::mt19937_64 random(12);
  std::uniform_real_distribution<double> share(-0.3, 0.3);
  int inside = 0, outside = 0, empty = 0;
  for (int trial = 0; trial < 3'000; ++trial) {
    SCOPED_TRACE(trial);
    std::vector<TouchedSurface> surfaces = test::RandomSurfaces(random);
    for (TouchedSurface& surface : surfaces) surface.max_normal.reset();
    const StanceForces forces(surfaces);
    const Eigen::Vector3d com_W = test::RandomCom(surfaces, random);
    const Eigen::Vector2d push(share(random), share(random));
    const std::vector<Eigen::Vector2d> corners = ComputePushPolygon(forces, push);
    const double residual = LeastSquaresResidual(forces, com_W, push);
    if (corners.empty()) {
      EXPECT_GT(residual, 1e-6);
      ++empty;
      continue;
    }
    const Eigen::Vector2d place = com_W.head<2>() + (com_W.z() - forces.origin_W().z()) * push;
    const double distance = SignedDistanceToPolygon(corners, place);
    if (distance < 0.0) {
      EXPECT_LT(residual, 1e-9) << distance;
      ++inside;
    } else if (distance > 2.0 * kPushPolygonAccuracy_m &&
               (place - forces.origin_W().head<2>()).cwiseAbs().maxCoeff() < 2.9) {
      EXPECT_GT(residual, 1e-9) << distance;
      ++outside;
    }
  }
  EXPECT_GT(inside, 300);
  EXPECT_GT(outside, 300);
  EXPECT_GT(empty, 300);
}

TEST(EquilibriumPolygon, WithoutAPushIsThePolygonOfTheWeight) {
  const StanceForces forces({Patch(Tilted(0.2), {0, 0.2, 0.1}, 0.5), Patch(Tilted(-0.1), {0, -0.2, 0}, 0.5)});
  const double with = PolygonArea(ComputePushPolygon(forces, Eigen::Vector2d::Zero()));
  EXPECT_NEAR(with, PolygonArea(ComputeEquilibriumPolygon(forces).corners), 2e-3);
}

TEST(StaticEquilibrium, ImbalanceAgreesWithGlpkOnRandomStances) {
  std::mt19937_64 random(12);
  const RobotModel robot = Stone();
  StaticEquilibrium equilibrium(robot, 9.8);
  double largest = 0.0;
  for (int trial = 0; trial < 10'000; ++trial) {
    const std::vector<TouchedSurface> surfaces = test::RandomSurfaces(random);
    const StanceForces forces(surfaces);
    const Eigen::Vector3d com_W = test::RandomCom(surfaces, random);
    const std::optional<double> expected = test::MinimumByGlpk(test::ImbalanceProgram(forces, com_W));
    ASSERT_TRUE(expected) << trial;
    // The program's moments are about the centre of mass; those of Imbalance about it, too.
    const double difference = std::abs(equilibrium.Imbalance(forces, com_W) - *expected);
    EXPECT_LT(difference, 1e-6) << trial;
    largest = std::max(largest, difference);
  }
  RecordProperty("largest_difference", std::to_string(largest));
}

TEST(StaticEquilibrium, BarsHoldWithBoundedForcesAsGlpkFinds) {
  std::mt19937_64 random(14);
  const RobotModel robot = Stone();
  StaticEquilibrium equilibrium(robot, 9.8);
  int held = 0, outside = 0, empty = 0, proven = 0;
  for (int trial = 0; trial < 3'000; ++trial) {
    SCOPED_TRACE(trial);
    const std::vector<TouchedSurface> surfaces = test::RandomSurfacesAndBars(random);
    const StanceForces forces(surfaces);
    const Eigen::Vector3d com_W = test::RandomCom(surfaces, random);
    const std::optional<double> expected = test::MinimumByGlpk(test::ImbalanceProgram(forces, com_W));
    ASSERT_TRUE(expected);
    EXPECT_NEAR(equilibrium.Imbalance(forces, com_W), *expected, 1e-6);
    const EquilibriumPolygon polygon = ComputeEquilibriumPolygon(forces);
    if (polygon.corners.empty()) {
      EXPECT_GT(*expected, 1e-9);
      ++empty;
      proven += polygon.slide && IsProof(CheckedProof(forces, polygon.slide->direction, polygon.slide->turn)) ? 1 : 0;
      continue;
    }
    const double distance = SignedDistanceToPolygon(polygon.corners, com_W.head<2>());
    if (distance < 0.0) {
      EXPECT_LT(*expected, 1e-8) << distance;
      ++held;
    } else if (distance > 2.0 * kPolygonAccuracy_m &&
               (com_W - forces.origin_W()).head<2>().cwiseAbs().maxCoeff() < 2.9) {
      EXPECT_GT(*expected, 1e-8) << distance;
      ++outside;
    }
  }
  EXPECT_GT(held, 300);
  EXPECT_GT(outside, 300);
  EXPECT_GT(empty, 300);
  EXPECT_GT(proven, empty * 9 / 10);
}

TEST(StanceForces, ABarPullsAndPushesWithinItsBound) {
  TouchedSurface bar;
  bar.max_component = 0.5;
  bar.points_W = {{0.1, 0, 1}, {-0.1, 0, 1}};
  const StanceForces forces({bar});
  ASSERT_EQ(forces.num_generators(), 12);
  EXPECT_EQ(forces.point_of(5), 0);
  EXPECT_EQ(forces.point_of(6), 1);
  EXPECT_EQ(forces.directions().rowwise().sum().norm(), 0.0) << "every direction and its opposite";
  // Both points carry all they can, so that the centre of mass is exactly below their middle.
  const std::vector<Eigen::Vector2d> corners = ComputeEquilibriumPolygon(forces).corners;
  ASSERT_FALSE(corners.empty());
  for (const Eigen::Vector2d& corner : corners) EXPECT_LT(corner.norm(), 1e-9);
  bar.max_component = 0.49;
  const EquilibriumPolygon weak = ComputeEquilibriumPolygon(StanceForces({bar}));
  EXPECT_TRUE(weak.corners.empty());
  ASSERT_TRUE(weak.slide);
  EXPECT_TRUE(IsProof(*weak.slide));
}

TEST(StaticEquilibrium, ImbalanceIsExactOnDegenerateStances) {
  std::mt19937_64 random(13);
  const RobotModel robot = Stone();
  StaticEquilibrium equilibrium(robot, 9.8);
  for (int trial = 0; trial < 500; ++trial) {
    const std::vector<TouchedSurface> surfaces = test::DegenerateSurfaces(random);
    const StanceForces forces(surfaces);
    Eigen::Vector3d com_W = test::RandomCom(surfaces, random);
    if (trial % 2 == 0) com_W.head<2>() = forces.origin_W().head<2>();  // at the very place that some can hold
    const std::optional<double> expected = test::MinimumByExactSimplex(test::ImbalanceProgram(forces, com_W));
    ASSERT_TRUE(expected) << trial;
    EXPECT_NEAR(equilibrium.Imbalance(forces, com_W), *expected, 1e-8) << trial;
  }
}

}  // namespace
}  // namespace legopt
