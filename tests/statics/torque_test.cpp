// Torque ratios and pushes against closed forms and GLPK.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>
#include <string>

#include "legopt/robot/kinematics.h"
#include "legopt/statics/stance_forces.h"
#include "legopt/statics/static_equilibrium.h"
#include "tests/statics/reference_program.h"

namespace legopt {
namespace {

constexpr double kGravity = 9.8;

std::string LinkText(const std::string& name, double mass, const std::string& com) {
  return "<link name='" + name + "'><inertial><origin xyz='" + com + "'/><mass value='" + std::to_string(mass) +
         "'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>";
}

std::string JointText(const std::string& name, const std::string& parent, const std::string& child,
                      const std::string& origin, const std::string& axis, double effort) {
  return "<joint name='" + name + "' type='revolute'><parent link='" + parent + "'/><child link='" + child +
         "'/><origin xyz='" + origin + "'/><axis xyz='" + axis +
         "'/><limit lower='-3' upper='3' velocity='5' effort='" + std::to_string(effort) + "'/></joint>";
}

/// A trunk of 20 kg on two legs with hip roll, hip pitch and knee, and a free arm of 2 kg with its mass at 0.5 m.
RobotModel TwoLegs() {
  std::string xml = "<robot name='two_legs'>" + LinkText("trunk", 20, "0.02 0.01 0.2");
  for (const std::string side : {"l", "r"}) {
    const std::string y = side == "l" ? "0.1" : "-0.1";
    xml += LinkText(side + "_hip", 0.5, "0 0 0") + LinkText(side + "_thigh", 3, "0 0 -0.2") +
           LinkText(side + "_shank", 2, "0 0 -0.2");
    xml += JointText(side + "_roll", "trunk", side + "_hip", "0 " + y + " 0", "1 0 0", 60);
    xml += JointText(side + "_pitch", side + "_hip", side + "_thigh", "0 0 0", "0 1 0", 90);
    xml += JointText(side + "_knee", side + "_thigh", side + "_shank", "0 0 -0.4", "0 1 0", 80);
  }
  xml += LinkText("arm", 2, "0.5 0 0") + JointText("shoulder", "trunk", "arm", "0 0 0.4", "0 1 0", 20);
  return RobotModel::FromUrdfText(xml + "</robot>", "two_legs.urdf", ".");
}

Eigen::VectorXd RandomPosture(const RobotModel& robot, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  Eigen::VectorXd x = robot.NeutralConfiguration();
  for (int dof = 0; dof < robot.num_dofs(); ++dof) x[dof] = 0.8 * unit(random);
  const Eigen::Quaterniond rotation(Eigen::AngleAxisd(0.4 * unit(random), Eigen::Vector3d::UnitX()) *
                                    Eigen::AngleAxisd(0.4 * unit(random), Eigen::Vector3d::UnitY()));
  x.tail<4>() << rotation.w(), rotation.x(), rotation.y(), rotation.z();
  return x;
}

/// Level soles of 0.2 x 0.1 m under both shanks, where they are.
std::vector<TouchedSurface> Soles(const RobotModel& robot, const Kinematics& kinematics, double friction) {
  std::vector<TouchedSurface> surfaces;
  for (const char* name : {"l_shank", "r_shank"}) {
    TouchedSurface& surface = surfaces.emplace_back();
    surface.link = robot.FindLink(name);
    surface.friction = friction;
    const Eigen::Vector3d centre = kinematics.link_pose(surface.link) * Eigen::Vector3d(0, 0, -0.4);
    for (const double x : {-0.1, 0.1}) {
      for (const double y : {-0.05, 0.05}) surface.points_W.emplace_back(centre + Eigen::Vector3d(x, y, 0));
    }
  }
  return surfaces;
}

/// The same program with Jacobians by differences of link poses and the arms' torques by definition: variables lambda,
/// t.
test::ReferenceProgram TorqueProgram(const RobotModel& robot, const StanceForces& forces, const Eigen::VectorXd& x) {
  const int L = forces.num_generators(), n = robot.num_dofs();
  const double weight_N = robot.total_mass() * kGravity, infinity = std::numeric_limits<double>::infinity();
  Kinematics at(robot), before(robot), after(robot);
  at.Update(x);
  test::ReferenceProgram program;
  program.A.setZero(6 + 2 * n, L + 1);
  program.lower.setConstant(6 + 2 * n, -infinity);
  program.upper.setZero(6 + 2 * n);
  for (int l = 0; l < L; ++l) {
    const Eigen::Vector3d position_W = forces.points()[static_cast<size_t>(forces.point_of(l))].position_W;
    program.A.col(l).head<6>() << forces.directions().col(l), (position_W - at.com()).cross(forces.directions().col(l));
  }
  program.lower.head<6>().setConstant(-kBalanceTolerance);
  program.upper.head<6>().setConstant(kBalanceTolerance);
  program.lower[2] += 1.0;
  program.upper[2] += 1.0;
  constexpr double kStep = 1e-6;
  for (int j = 0; j < n; ++j) {
    Eigen::VectorXd low = x, high = x;
    low[j] -= kStep;
    high[j] += kStep;
    before.Update(low);
    after.Update(high);
    // The torque is the rate of the potential energy less the power of the contact forces.
    const double gravity = robot.total_mass() * kGravity * (after.com().z() - before.com().z()) / (2.0 * kStep);
    const double limit = robot.effort_limits()[j];
    for (int l = 0; l < L; ++l) {
      const StanceForces::Point& point = forces.points()[static_cast<size_t>(forces.point_of(l))];
      const Eigen::Vector3d point_L = at.link_pose(point.link).inverse() * point.position_W;
      const Eigen::Vector3d rate =
          (after.link_pose(point.link) * point_L - before.link_pose(point.link) * point_L) / (2.0 * kStep);
      const double share = weight_N * rate.dot(forces.directions().col(l)) / limit;
      program.A(6 + 2 * j, l) = -share;
      program.A(6 + 2 * j + 1, l) = share;
    }
    program.A(6 + 2 * j, L) = program.A(6 + 2 * j + 1, L) = -1.0;
    program.upper[6 + 2 * j] = -gravity / limit;
    program.upper[6 + 2 * j + 1] = gravity / limit;
  }
  program.columns_upper.setConstant(L + 1, infinity);
  program.c.setZero(L + 1);
  program.c[L] = 1.0;
  return program;
}

TEST(TorqueRatio, OfAFreeArmIsItsWeightTimesItsLever) {
  const RobotModel robot = TwoLegs();
  Kinematics kinematics(robot);
  Eigen::VectorXd x = robot.NeutralConfiguration();
  kinematics.Update(x);
  StaticEquilibrium equilibrium(robot, kGravity);
  const TorqueRatio result = equilibrium.ComputeTorqueRatio(StanceForces(Soles(robot, kinematics, 0.6)), kinematics);
  // Straight legs carry without torque, but the centre of mass is off their middle; the shoulder needs 9.8 of 20 N m.
  EXPECT_NEAR(result.ratio, 2.0 * kGravity * 0.5 / 20.0, 1e-9);
  EXPECT_EQ(robot.joints()[static_cast<size_t>(robot.dof_joint(result.dof))].name, "shoulder");
}

TEST(TorqueRatio, ItsForcesBalanceTheRobotAndGiveItsTorques) {
  const RobotModel robot = TwoLegs();
  Kinematics kinematics(robot);
  StaticEquilibrium equilibrium(robot, kGravity);
  std::mt19937_64 random(4);
  Eigen::MatrixXd jacobian(3, robot.tangent_size());
  Eigen::VectorXd gravity(robot.num_dofs());
  int held = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const Eigen::VectorXd x = RandomPosture(robot, random);
    kinematics.Update(x);
    const StanceForces forces(Soles(robot, kinematics, 0.6));
    const TorqueRatio result = equilibrium.ComputeTorqueRatio(forces, kinematics);
    if (!std::isfinite(result.ratio)) continue;
    ++held;
    const double weight_N = robot.total_mass() * kGravity, slack = weight_N * kBalanceTolerance * (1 + 1e-6);
    Eigen::Vector3d sum(0, 0, -weight_N), moment = Eigen::Vector3d::Zero();
    kinematics.GravityTorques(kGravity, gravity);
    Eigen::VectorXd torques = gravity;
    for (size_t k = 0; k < forces.points().size(); ++k) {
      const StanceForces::Point& point = forces.points()[k];
      const Eigen::Vector3d& force_N = result.forces_N[k];
      EXPECT_GE(force_N.z(), -1e-9);
      EXPECT_LE(force_N.head<2>().norm(), 0.6 * force_N.z() + 1e-9);
      sum += force_N;
      moment += (point.position_W - kinematics.com()).cross(force_N);
      kinematics.PointJacobian(point.link, point.position_W, jacobian);
      torques -= jacobian.leftCols(robot.num_dofs()).transpose() * force_N;
    }
    EXPECT_LE(sum.cwiseAbs().maxCoeff(), slack);
    EXPECT_LE(moment.cwiseAbs().maxCoeff(), slack);
    EXPECT_LT((torques - result.torques).cwiseAbs().maxCoeff(), 1e-6);
    EXPECT_NEAR((torques.cwiseAbs().array() / robot.effort_limits().array()).maxCoeff(), result.ratio, 1e-9);
    EXPECT_LE(result.proven_ratio, result.ratio + 1e-9);
    EXPECT_GT(result.proven_ratio, result.ratio - 1e-8) << "the multipliers alone prove it";
  }
  EXPECT_GT(held, 50);
}

TEST(TorqueRatio, AgreesWithGlpk) {
  const RobotModel robot = TwoLegs();
  Kinematics kinematics(robot);
  StaticEquilibrium equilibrium(robot, kGravity);
  std::mt19937_64 random(5);
  int held = 0;
  for (int trial = 0; trial < 1'000; ++trial) {
    const Eigen::VectorXd x = RandomPosture(robot, random);
    kinematics.Update(x);
    const StanceForces forces(Soles(robot, kinematics, 0.6));
    const double ratio = equilibrium.ComputeTorqueRatio(forces, kinematics).ratio;
    const std::optional<double> expected = test::MinimumByGlpk(TorqueProgram(robot, forces, x));
    ASSERT_EQ(std::isfinite(ratio), expected.has_value()) << trial;
    if (!expected) continue;
    ++held;
    EXPECT_NEAR(ratio, *expected, 1e-6) << trial;
  }
  EXPECT_GT(held, 150);
}

TEST(LoadedRatio, GradientIsTheRateOfTheOptimum) {
  const RobotModel robot = TwoLegs();
  Kinematics kinematics(robot);
  StaticEquilibrium equilibrium(robot, kGravity);
  std::mt19937_64 random(6);
  std::optional<StanceForces> forces;
  const auto ratio_at = [&](const Eigen::VectorXd& x, LoadedRatio* result, bool with_gradient) {
    kinematics.Update(x);
    equilibrium.ComputeLoadedRatio(*forces, kinematics, 1e-4, with_gradient, result);
    return result->ratio;
  };
  int compared = 0, smooth = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::VectorXd x = RandomPosture(robot, random);
    kinematics.Update(x);
    forces.emplace(Soles(robot, kinematics, 0.6));
    LoadedRatio result, moved;
    if (!std::isfinite(ratio_at(x, &result, true))) continue;
    for (int j = 0; j < robot.tangent_size(); ++j) {
      constexpr double kStep = 1e-6;
      Eigen::VectorXd dx = Eigen::VectorXd::Zero(robot.tangent_size()), next(x.size());
      dx[j] = kStep;
      Retract(x, dx, next);
      const double above = ratio_at(next, &moved, false);
      Retract(x, -dx, next);
      const double below = ratio_at(next, &moved, false);
      if (!std::isfinite(above) || !std::isfinite(below)) continue;
      ++compared;
      const double forwards = (above - result.ratio) / kStep, backwards = (result.ratio - below) / kStep;
      if (std::abs(forwards - backwards) > 1e-3) continue;  // the optimal basis changes here
      ++smooth;
      EXPECT_NEAR(result.gradient[j], (above - below) / (2.0 * kStep), 1e-4) << trial << " " << j;
    }
  }
  EXPECT_GT(compared, 300);
  EXPECT_GT(smooth, compared * 8 / 10);
}

TEST(WeakestPush, IsThatOfTheJudgeAndItsGradientTheRateOfTheOptimum) {
  const RobotModel robot = TwoLegs();
  Kinematics kinematics(robot);
  StaticEquilibrium equilibrium(robot, kGravity);
  std::mt19937_64 random(7);
  std::optional<StanceForces> forces;
  constexpr double kMore = 1e4;  // more than any posture resists
  const auto push_at = [&](const Eigen::VectorXd& x, WeakestPush* result, bool with_gradient) {
    kinematics.Update(x);
    equilibrium.ComputeWeakestPush(*forces, kinematics, kMore, with_gradient, result);
    return result->push_N;
  };
  int compared = 0, smooth = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const Eigen::VectorXd x = RandomPosture(robot, random);
    kinematics.Update(x);
    forces.emplace(Soles(robot, kinematics, 0.6));
    const double judged_N = equilibrium.ResistedPush_N(*forces, kinematics);
    WeakestPush result, moved;
    const double push_N = push_at(x, &result, true);
    if (!std::isfinite(push_N)) {
      EXPECT_LT(judged_N, 0.0);
      continue;
    }
    EXPECT_NEAR(push_N, judged_N, 1e-6 * judged_N + 1e-9);
    equilibrium.ComputeWeakestPush(*forces, kinematics, 0.99 * push_N, false, &moved);
    EXPECT_TRUE(push_N < 1e-3 || moved.push_N > kMore) << trial;  // enough
    for (int j = 0; j < robot.tangent_size(); ++j) {
      constexpr double kStep = 1e-6;
      Eigen::VectorXd dx = Eigen::VectorXd::Zero(robot.tangent_size()), next(x.size());
      dx[j] = kStep;
      Retract(x, dx, next);
      const double above = push_at(next, &moved, false);
      Retract(x, -dx, next);
      const double below = push_at(next, &moved, false);
      if (!std::isfinite(above) || !std::isfinite(below)) continue;
      ++compared;
      const double forwards = (above - push_N) / kStep, backwards = (push_N - below) / kStep;
      if (std::abs(forwards - backwards) > 0.1) continue;  // the optimal basis or the direction changes here
      ++smooth;
      EXPECT_NEAR(result.gradient[j], (above - below) / (2.0 * kStep), 0.02 * std::max(1.0, std::abs(forwards)))
          << trial << " " << j;
    }
  }
  EXPECT_GT(compared, 300);
  EXPECT_GT(smooth, compared * 8 / 10);
}

TEST(ResistedPush, OfALevelStanceIsItsLeverOverItsHeight) {
  const RobotModel robot = TwoLegs();
  Kinematics kinematics(robot);
  kinematics.Update(robot.NeutralConfiguration());
  const std::vector<TouchedSurface> soles = Soles(robot, kinematics, 0.6);
  StaticEquilibrium equilibrium(robot, kGravity);
  // Forwards, the moment of the push about the toes is that of the weight; the slack of the balance shifts the weight
  // by 1 mm and adds a thousandth of it to the push.
  const double height_m = kinematics.com().z() - soles[0].points_W[0].z();
  const double lever_m = 0.1 - std::abs(kinematics.com().x()), weight_N = robot.total_mass() * kGravity;
  const double slack_N = weight_N * kBalanceTolerance * (1.0 + 1.0 / height_m);
  const double push_N = equilibrium.ResistedPush_N(StanceForces(soles), kinematics);
  EXPECT_NEAR(push_N, weight_N * lever_m / height_m, 2.0 * slack_N);
}

TEST(ResistedPush, IsNegativeIfThePostureCannotBeHeld) {
  const RobotModel robot = TwoLegs();
  Kinematics kinematics(robot);
  Eigen::VectorXd x = robot.NeutralConfiguration();
  kinematics.Update(x);
  std::vector<TouchedSurface> soles = Soles(robot, kinematics, 0.6);
  for (TouchedSurface& sole : soles) {
    for (Eigen::Vector3d& point_W : sole.points_W) point_W.x() += 0.5;  // far in front
  }
  StaticEquilibrium equilibrium(robot, kGravity);
  EXPECT_LT(equilibrium.ResistedPush_N(StanceForces(soles), kinematics), 0.0);
}

/// The push along a direction as the largest s, with Jacobians by differences: variables lambda, s. Without efforts
/// only the balance remains.
test::ReferenceProgram PushProgram(const RobotModel& robot, const StanceForces& forces, const Eigen::VectorXd& x,
                                   const Eigen::Vector3d& direction, PushLimits limits) {
  test::ReferenceProgram program = TorqueProgram(robot, forces, x);
  const int L = forces.num_generators(), n = robot.num_dofs();
  const double weight_N = robot.total_mass() * kGravity;
  program.A.col(L).setZero();
  program.A.col(L).head<3>() = direction;
  Kinematics before(robot), after(robot);
  constexpr double kStep = 1e-6;
  for (int j = 0; j < n; ++j) {
    Eigen::VectorXd low = x, high = x;
    low[j] -= kStep;
    high[j] += kStep;
    before.Update(low);
    after.Update(high);
    const double share =
        weight_N * direction.dot(after.com() - before.com()) / (2.0 * kStep) / robot.effort_limits()[j];
    program.A(6 + 2 * j, L) = -share;  // torque share <= 1
    program.A(6 + 2 * j + 1, L) = share;
    program.upper.segment<2>(6 + 2 * j).array() += 1.0;
  }
  if (limits == PushLimits::kContacts) {
    program.A.conservativeResize(6, Eigen::NoChange);
    program.lower.conservativeResize(6);
    program.upper.conservativeResize(6);
  }
  program.columns_upper[L] = 10.0;
  program.c[L] = -1.0;
  return program;
}

class ResistedPushes : public testing::TestWithParam<PushLimits> {};
INSTANTIATE_TEST_SUITE_P(Limits, ResistedPushes,
                         testing::Values(PushLimits::kContacts, PushLimits::kContactsAndEfforts),
                         [](const auto& limits) {
                           return limits.param == PushLimits::kContacts ? "Contacts" : "Efforts";
                         });

TEST_P(ResistedPushes, AgreeWithGlpkInAllDirections) {
  const RobotModel robot = TwoLegs();
  Kinematics kinematics(robot);
  StaticEquilibrium equilibrium(robot, kGravity);
  const double weight_N = robot.total_mass() * kGravity;
  std::mt19937_64 random(7);
  int held = 0, refused = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const Eigen::VectorXd x = RandomPosture(robot, random);
    kinematics.Update(x);
    const StanceForces forces(Soles(robot, kinematics, 0.6));
    const DirectedPushes pushes_N = equilibrium.ResistedPushes_N(forces, kinematics, GetParam());
    for (int k = 0; k < kPushDirections; ++k) {
      const double push_N = pushes_N[static_cast<size_t>(k)];
      const std::optional<double> least =
          test::MinimumByGlpk(PushProgram(robot, forces, x, PushDirection(k), GetParam()));
      ASSERT_EQ(std::isfinite(push_N), least.has_value()) << trial << " " << k;
      ++(least ? held : refused);
      if (!least) continue;
      EXPECT_NEAR(push_N, -*least * weight_N, 1e-4) << trial << " " << k;
    }
  }
  EXPECT_GT(held, 300);
  EXPECT_GT(refused, 300);
}

TEST(ResistedPush, EffortLimitsOnlyReduceIt) {
  const RobotModel robot = TwoLegs();
  Kinematics kinematics(robot);
  StaticEquilibrium equilibrium(robot, kGravity);
  std::mt19937_64 random(8);
  int reduced = 0;
  for (int trial = 0; trial < 1'000; ++trial) {
    kinematics.Update(RandomPosture(robot, random));
    const StanceForces forces(Soles(robot, kinematics, 0.6));
    const DirectedPushes all_N = equilibrium.ResistedPushes_N(forces, kinematics, PushLimits::kContactsAndEfforts);
    const DirectedPushes contacts_N = equilibrium.ResistedPushes_N(forces, kinematics, PushLimits::kContacts);
    for (size_t k = 0; k < all_N.size(); ++k) {
      EXPECT_LE(all_N[k], contacts_N[k] + 1e-9);
      reduced += std::isfinite(all_N[k]) && all_N[k] < contacts_N[k] - 1.0 ? 1 : 0;
    }
    EXPECT_EQ(equilibrium.ResistedPush_N(forces, kinematics), std::ranges::min(all_N));
  }
  EXPECT_GT(reduced, 10);
}

TEST(EffortLimits, AreReadFromTheFile) {
  const RobotModel robot = TwoLegs();
  EXPECT_EQ(robot.effort_limits()[robot.num_dofs() - 1], 20.0);
  EXPECT_EQ(robot.velocity_limits()[0], 5.0);
  const std::string xml = "<robot name='one'>" + LinkText("trunk", 1, "0 0 0") + LinkText("arm", 1, "0 0 0") +
                          JointText("shoulder", "trunk", "arm", "0 0 0", "0 1 0", 0) + "</robot>";
  EXPECT_EQ(RobotModel::FromUrdfText(xml, "one.urdf", ".").effort_limits()[0], Joint::kNoLimit) << "0: not known";
}

}  // namespace
}  // namespace legopt
