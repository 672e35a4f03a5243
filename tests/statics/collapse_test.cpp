// Policy: a posture without equilibrium has a motion that proves it, and whose contacts move as on a bench: a block on
// a steep slope slips down, a robot beyond its soles tips about their edge, a hand on a wall slips down the wall.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "legopt/robot/robot_model.h"
#include "legopt/statics/collapse_motion.h"
#include "legopt/statics/static_equilibrium.h"
#include "tests/statics/random_stances.h"

namespace legopt {
namespace {

using Eigen::Vector3d;

RobotModel Block() {
  Link link;
  link.name = "block";
  link.mass = 10.0;
  return RobotModel("block", {link}, {});
}

TouchedSurface Sole(const Vector3d& centre, double friction, const Eigen::Matrix3d& axes_W) {
  TouchedSurface surface;
  surface.axes_W = axes_W;
  surface.friction = friction;
  for (const double x : {-0.1, 0.1}) {
    for (const double y : {-0.05, 0.05}) surface.points_W.emplace_back(centre + axes_W * Vector3d(x, y, 0));
  }
  return surface;
}

Eigen::Matrix3d TiltedForward(double angle_rad) {
  return Eigen::AngleAxisd(angle_rad, Vector3d::UnitY()).toRotationMatrix();
}

std::vector<SurfaceMovement> Movements(const std::vector<TouchedSurface>& surfaces, const Vector3d& com_W) {
  const RobotModel block = Block();
  const StanceForces forces(surfaces);
  const auto motion = StaticEquilibrium(block, 9.8).FindCollapse(forces, com_W);
  EXPECT_TRUE(motion);
  return motion ? MovementsOf(*motion, surfaces, forces) : std::vector<SurfaceMovement>{};
}

TEST(CollapseMotion, ASlopeSteeperThanFrictionSlipsDownhill) {
  const double angle = std::atan(0.5) + 0.05;
  const std::vector<TouchedSurface> surfaces = {Sole({0, 0.1, 0}, 0.5, TiltedForward(angle)),
                                                Sole({0, -0.1, 0}, 0.5, TiltedForward(angle))};
  // The proof of a posture may also turn the robot, so that one of two contacts lifts.
  int slips = 0;
  for (const SurfaceMovement& movement : Movements(surfaces, {0, 0, 0.5})) {
    EXPECT_GT(movement.direction_W.dot(surfaces[0].axes_W.col(0)), 0.8) << "down the slope, along its x axis";
    slips += movement.movement == ContactMovement::kSlips ? 1 : 0;
  }
  EXPECT_GE(slips, 1);
}

TEST(CollapseMotion, BeyondItsSolesARobotTipsAboutTheirEdge) {
  // The centre of mass is beyond the front edges of both soles.
  const std::vector<SurfaceMovement> both =
      Movements({Sole({0, 0.1, 0}, 0.7, TiltedForward(0)), Sole({0, -0.1, 0}, 0.7, TiltedForward(0))}, {0.15, 0, 0.8});
  for (const SurfaceMovement& movement : both) {
    EXPECT_EQ(movement.movement, ContactMovement::kRests);
    EXPECT_NEAR(movement.position_W.x(), 0.1, 1e-9) << "the front edge";
  }
  // Beyond the outer edge of the left sole, the right one lifts.
  const std::vector<SurfaceMovement> side =
      Movements({Sole({0, 0.1, 0}, 0.7, TiltedForward(0)), Sole({0, -0.1, 0}, 0.7, TiltedForward(0))}, {0, 0.18, 0.8});
  ASSERT_EQ(side.size(), 2u);
  EXPECT_EQ(side[0].movement, ContactMovement::kRests);
  EXPECT_EQ(side[1].movement, ContactMovement::kLifts);
}

TEST(CollapseMotion, AHandOnASlipperyWallSlipsDown) {
  // One sole, and a palm on a wall in front whose friction is too small for a centre of mass between them.
  Eigen::Matrix3d wall;
  wall.col(2) = -Vector3d::UnitX();
  wall.col(0) = Vector3d::UnitY();
  wall.col(1) = wall.col(2).cross(wall.col(0));
  const std::vector<SurfaceMovement> movements =
      Movements({Sole({0, 0, 0}, 0.1, TiltedForward(0)), Sole({0.6, 0, 1.0}, 0.1, wall)}, {0.45, 0, 0.6});
  ASSERT_EQ(movements.size(), 2u);
  EXPECT_EQ(movements[0].movement, ContactMovement::kSlips) << "the feet slip away from the wall";
  EXPECT_LT(movements[0].direction_W.x(), -0.99);
  EXPECT_EQ(movements[1].movement, ContactMovement::kSlips);
  EXPECT_LT(movements[1].direction_W.z(), -0.99);
}

TEST(CollapseMotion, ABarYieldsBeyondItsForce) {
  TouchedSurface bar;
  bar.max_component = 0.2;
  bar.points_W = {{0, 0.05, 1.0}, {0, -0.05, 1.0}};
  const std::vector<SurfaceMovement> movements = Movements({bar}, {0, 0, 0.5});
  ASSERT_EQ(movements.size(), 1u);
  EXPECT_EQ(movements[0].movement, ContactMovement::kYields);
  EXPECT_LT(movements[0].direction_W.z(), -0.9);
}

TEST(CollapseMotion, ProvesEachImbalanceOnRandomStances) {
  std::mt19937_64 random(1);
  const RobotModel block = Block();
  StaticEquilibrium equilibrium(block, 9.8);
  int failed = 0, moving = 0;
  for (int i = 0; i < 600; ++i) {
    const std::vector<TouchedSurface> surfaces =
        i % 2 == 0 ? test::RandomSurfaces(random) : test::RandomSurfacesAndBars(random);
    const StanceForces forces(surfaces);
    const Vector3d com_W = test::RandomCom(surfaces, random);
    const double imbalance = equilibrium.Imbalance(forces, com_W);
    const std::optional<CollapseMotion> motion = equilibrium.FindCollapse(forces, com_W);
    if (imbalance > 1e-5) {
      ++failed;
      ASSERT_TRUE(motion) << i;
      // The margin is the imbalance itself: duality.
      EXPECT_NEAR(CollapseMargin(*motion, forces, com_W), imbalance, 1e-7) << i;
      const auto moves = [](const SurfaceMovement& m) { return m.movement != ContactMovement::kRests; };
      const std::vector<SurfaceMovement> movements = MovementsOf(*motion, surfaces, forces);
      moving += std::ranges::any_of(movements, moves) ? 1 : 0;
      for (const SurfaceMovement& m : movements) EXPECT_EQ(m.direction_W.norm() > 0.5, moves(m)) << i;
    } else if (imbalance < 1e-7) {
      EXPECT_FALSE(motion) << i;
    }
  }
  EXPECT_GT(failed, 100);
  EXPECT_GT(moving, 50);
}

}  // namespace
}  // namespace legopt
