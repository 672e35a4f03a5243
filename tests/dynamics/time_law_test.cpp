// Shortest durations against closed forms.
#include "legopt/dynamics/time_law.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

namespace legopt {
namespace {

constexpr double kGravity = 9.8, kMass = 3.0, kFootMass = 1.0, kHeight_m = 0.5;

/// A foot that carries a mass: on a horizontal slide at height kHeight_m, or as a pendulum of length kHeight_m.
RobotModel Carrier(const std::string& joint_type, const std::string& axis, double effort, double velocity) {
  const bool slides = joint_type == "prismatic";
  const std::string com = slides ? "0 0 0" : "0 0 -" + std::to_string(kHeight_m);
  return RobotModel::FromUrdfText(
      "<robot name='carrier'><link name='foot'><inertial><mass value='" + std::to_string(kFootMass) +
          "'/><inertia ixx='0' iyy='0' izz='0' ixy='0' ixz='0' iyz='0'/></inertial></link><link name='mass'><inertial>"
          "<origin xyz='" +
          com + "'/><mass value='" + std::to_string(kMass) +
          "'/><inertia ixx='0' iyy='0' izz='0' ixy='0' ixz='0' iyz='0'/></inertial></link><joint name='move' type='" +
          joint_type + "'><parent link='foot'/><child link='mass'/><origin xyz='0 0 " +
          std::to_string(slides ? kHeight_m : 2.0 * kHeight_m) + "'/><axis xyz='" + axis +
          "'/><limit lower='-9' upper='9' effort='" + std::to_string(effort) + "' velocity='" +
          std::to_string(velocity) + "'/></joint></robot>",
      "carrier.urdf", ".");
}

/// Level ground under the foot, with corners at +-half lengths.
StanceForces Ground(double friction, double half_m) {
  TouchedSurface surface;
  surface.friction = friction;
  for (const double x : {-half_m, half_m}) {
    for (const double y : {-half_m, half_m}) surface.points_W.emplace_back(x, y, 0.0);
  }
  return StanceForces({surface});
}

/// The joint moves from one value to another.
PathLimits Move(const RobotModel& robot, const StanceForces& forces, double from, double to, double gravity = kGravity,
                int intervals = 400) {
  std::vector<Eigen::VectorXd> points(2, robot.NeutralConfiguration());
  points[0][0] = from;
  points[1][0] = to;
  const PathSpline spline({0.0, 1.0}, points);
  PhaseSetBuilder builder(robot, gravity);
  std::vector<double> grid;
  std::vector<PhaseSet> sets;
  CurvePoint point;
  for (int k = 0; k <= intervals; ++k) {
    grid.push_back(static_cast<double>(k) / intervals);
    spline.Evaluate(grid.back(), &point);
    sets.push_back(builder.Compute(forces, point, 0.0));
  }
  return JoinSets(grid, sets);
}

double ShortestDuration_s(const PathLimits& path) { return ComputeTimeLaw(path).duration_s; }

constexpr double kAccuracy = 1e-3;  // share

TEST(TimeLaw, DoubleIntegratorIsBangBang) {
  constexpr double kForce_N = 6.0, kDistance_m = 0.4;
  const RobotModel robot = Carrier("prismatic", "1 0 0", kForce_N, 100);
  const double expected_s = 2.0 * std::sqrt(kDistance_m * kMass / kForce_N);
  EXPECT_NEAR(ShortestDuration_s(Move(robot, Ground(5, 3), -0.1, 0.3)), expected_s, kAccuracy * expected_s);
}

TEST(TimeLaw, VelocityLimitAddsACruise) {
  constexpr double kForce_N = 6.0, kDistance_m = 1.0, kSpeed = 0.5;
  const RobotModel robot = Carrier("prismatic", "1 0 0", kForce_N, kSpeed);
  const double acceleration = kForce_N / kMass;
  const double expected_s = kDistance_m / kSpeed + kSpeed / acceleration;
  const PathLimits path = Move(robot, Ground(5, 5), -0.5, 0.5);
  const TimeLaw law = ComputeTimeLaw(path);
  EXPECT_NEAR(law.duration_s, expected_s, kAccuracy * expected_s);
  EXPECT_EQ(law.limits[200].kind, TimeLimit::kVelocity);
  EXPECT_EQ(law.limits[2].kind, TimeLimit::kTorque);
  EXPECT_NEAR(UniformDuration_s(path), kDistance_m / kSpeed, 1e-6);
}

TEST(TimeLaw, StrongJointReachesItsVelocityLimitSoon) {
  constexpr double kForce_N = 60.0, kDistance_m = 1.0, kSpeed = 0.5;
  const RobotModel robot = Carrier("prismatic", "1 0 0", kForce_N, kSpeed);
  const double expected_s = kDistance_m / kSpeed + kSpeed * kMass / kForce_N;
  EXPECT_NEAR(ShortestDuration_s(Move(robot, Ground(50, 50), -0.5, 0.5)), expected_s, 2 * kAccuracy * expected_s);
}

TEST(TimeLaw, NoVelocityLimitIsNeeded) {
  constexpr double kForce_N = 6.0, kDistance_m = 0.4;
  const RobotModel robot = Carrier("prismatic", "1 0 0", kForce_N, 0.0);  // 0 in a URDF: no limit
  ASSERT_TRUE(std::isinf(robot.velocity_limits()[0]));
  const double expected_s = 2.0 * std::sqrt(kDistance_m * kMass / kForce_N);
  EXPECT_NEAR(ShortestDuration_s(Move(robot, Ground(5, 3), -0.1, 0.3)), expected_s, kAccuracy * expected_s);
}

TEST(TimeLaw, GridOfTwoIntervalsHasOneFreePoint) {
  constexpr double kForce_N = 6.0, kDistance_m = 0.4;
  const RobotModel robot = Carrier("prismatic", "1 0 0", kForce_N, 100);
  const double expected_s = 2.0 * std::sqrt(kDistance_m * kMass / kForce_N);
  EXPECT_NEAR(ShortestDuration_s(Move(robot, Ground(5, 3), -0.1, 0.3, kGravity, 2)), expected_s, 1e-3);
}

TEST(TimeLaw, GridOfOneIntervalIsBlocked) {
  const RobotModel robot = Carrier("prismatic", "1 0 0", 6.0, 100);
  const PathLimits path = Move(robot, Ground(5, 3), -0.1, 0.3, kGravity, 1);
  const TimeLaw law = ComputeTimeLaw(path);
  EXPECT_FALSE(law.exists) << "rest at both points";
  EXPECT_EQ(law.blocked.point, 0);
}

TEST(TimeLaw, ReversedPathTakesAsLong) {
  const RobotModel robot = Carrier("prismatic", "1 0 0", 1e3, 100);
  const double forth_s = ShortestDuration_s(Move(robot, Ground(5, 0.1), -0.05, 0.03));
  EXPECT_NEAR(ShortestDuration_s(Move(robot, Ground(5, 0.1), 0.03, -0.05)), forth_s, 5 * kAccuracy * forth_s);
}

TEST(TimeLaw, FrictionBoundsTheForceOfTheFoot) {
  constexpr double kFriction = 0.3, kDistance_m = 0.4;
  const RobotModel robot = Carrier("prismatic", "1 0 0", 1e3, 100);
  const double acceleration = kFriction * kGravity * (kMass + kFootMass) / kMass;
  const double expected_s = 2.0 * std::sqrt(kDistance_m / acceleration);
  const PathLimits path = Move(robot, Ground(kFriction, 3), -0.2, 0.2);
  const TimeLaw law = ComputeTimeLaw(path);
  EXPECT_NEAR(law.duration_s, expected_s, kAccuracy * expected_s);
  EXPECT_EQ(law.limits[100].kind, TimeLimit::kContact);
}

/// Point mass on a short foot: m a h <= (total weight) half - m g x, that is, the zero-moment point stays inside.
TEST(TimeLaw, ShortFootTipsOver) {
  constexpr double kHalf_m = 0.1, kDistance_m = 0.1;
  const RobotModel robot = Carrier("prismatic", "1 0 0", 1e3, 100);
  // x'' = (x + half M / m) g / h while speeding up: the foot presses on its rear edge.
  const double rate = std::sqrt(kGravity / kHeight_m);
  const double edge = kHalf_m * (kMass + kFootMass) / kMass;
  // From -d/2 at rest to 0, by symmetry half of the time: x + edge = (edge - d/2) cosh(rate t).
  const double expected_s = 2.0 * std::acosh(edge / (edge - 0.5 * kDistance_m)) / rate;
  EXPECT_NEAR(ShortestDuration_s(Move(robot, Ground(5, kHalf_m), -0.5 * kDistance_m, 0.5 * kDistance_m)), expected_s,
              kAccuracy * expected_s);
}

TEST(TimeLaw, PendulumSwingsThroughTheBottom) {
  constexpr double kTorque_Nm = 10.0, kAngle = 0.6;
  const RobotModel robot = Carrier("revolute", "0 1 0", kTorque_Nm, 100);
  const double inertia = kMass * kHeight_m * kHeight_m;
  constexpr int kSamples = 200'000;
  double half_s = 0.0;  // by the midpoint rule in r, angle = -kAngle + r^2, which removes the singularity at rest
  for (int k = 0; k < kSamples; ++k) {
    const double r = std::sqrt(kAngle) * (k + 0.5) / kSamples, angle = r * r - kAngle;
    const double energy =
        kTorque_Nm * (angle + kAngle) + kMass * kGravity * kHeight_m * (std::cos(angle) - std::cos(kAngle));
    half_s += 2.0 * r / std::sqrt(2.0 * energy / inertia) * std::sqrt(kAngle) / kSamples;
  }
  EXPECT_NEAR(ShortestDuration_s(Move(robot, Ground(5, 5), -kAngle, kAngle)), 2.0 * half_s, kAccuracy * 2.0 * half_s);
}

TEST(TimeLaw, NoneIfTheTorqueCannotHoldThePendulum) {
  const RobotModel robot = Carrier("revolute", "0 1 0", 5.0, 100);
  const double largest = std::asin(5.0 / (kMass * kGravity * kHeight_m));
  EXPECT_TRUE(std::isfinite(ShortestDuration_s(Move(robot, Ground(5, 5), 0.0, 0.99 * largest))));
  const PathLimits path = Move(robot, Ground(5, 5), 0.0, 1.01 * largest);
  const TimeLaw law = ComputeTimeLaw(path);
  EXPECT_FALSE(law.exists);
  EXPECT_TRUE(std::isinf(law.duration_s));
  EXPECT_EQ(law.blocked.owner.kind, TimeLimit::kTorque);
  EXPECT_EQ(law.blocked.owner.index, 0);
}

TEST(TimeLaw, NoneIfThePendulumCannotRestAtTheStart) {
  const RobotModel robot = Carrier("revolute", "0 1 0", 5.0, 100);
  const double largest = std::asin(5.0 / (kMass * kGravity * kHeight_m));
  EXPECT_TRUE(std::isinf(ShortestDuration_s(Move(robot, Ground(5, 5), 1.2 * largest, 0.0)))) << "cannot wait there";
}

TEST(TimeLaw, NoneOnAnIcySlope) {
  const RobotModel robot = Carrier("prismatic", "1 0 0", 1e3, 100);
  TouchedSurface surface;
  surface.friction = 0.3;
  surface.axes_W = Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitY()).toRotationMatrix();
  surface.points_W = {{1, 1, 0}, {-1, 1, 0}, {-1, -1, 0}, {1, -1, 0}};
  const PathLimits path = Move(robot, StanceForces({surface}), -0.1, 0.1);
  const TimeLaw law = ComputeTimeLaw(path);
  EXPECT_FALSE(law.exists);
  EXPECT_EQ(law.blocked.owner.kind, TimeLimit::kContact);
}

TEST(TimeLaw, HalvingTheGridChangesLittle) {
  const RobotModel robot = Carrier("prismatic", "1 0 0", 1e3, 100);
  const double coarse_s = ShortestDuration_s(Move(robot, Ground(5, 0.1), -0.05, 0.05, kGravity, 32));
  const double fine_s = ShortestDuration_s(Move(robot, Ground(5, 0.1), -0.05, 0.05, kGravity, 64));
  EXPECT_NEAR(coarse_s, fine_s, 0.02 * fine_s);
}

TEST(TimeLaw, WithoutGravityAFootCannotPull) {
  const RobotModel robot = Carrier("prismatic", "1 0 0", 1e3, 100);
  const PathLimits path = Move(robot, Ground(5, 3), -0.1, 0.1, 0.0);
  EXPECT_TRUE(std::isinf(ShortestDuration_s(path))) << "friction needs a normal force, which nothing presses";
}

TEST(TimeLaw, NeverLongerWithTwiceTheLimitsNorThanGreedy) {
  double before_s = 1e9;
  for (double factor = 1.0; factor < 20.0; factor *= 2.0) {
    const RobotModel robot = Carrier("prismatic", "1 0 0", 2.0 * factor, 0.2 * factor);
    const PathLimits path = Move(robot, Ground(0.1 * factor, 0.05 * factor), -0.04, 0.04);
    const double duration_s = ShortestDuration_s(path);
    EXPECT_LE(duration_s, before_s * (1 + 1e-9)) << factor;
    EXPECT_LE(duration_s, ComputeGreedyTimeLaw(path).duration_s) << factor;
    before_s = duration_s;
  }
}

/// Firm ground on the first half of the way, slippery ground on the second: all braking there is at its limit b, and
/// the first half ends at the speed from which that suffices.
TEST(TimeLaw, ContactsThatChangeAtAPointLimitBothSides) {
  constexpr double kDistance_m = 0.4, kFirm = 0.6, kSlippery = 0.2;
  const RobotModel robot = Carrier("prismatic", "1 0 0", 1e3, 100);
  PathLimits path = Move(robot, Ground(kFirm, 3), -0.2, 0.2);
  const PathLimits slippery = Move(robot, Ground(kSlippery, 3), -0.2, 0.2);
  for (size_t k = path.intervals.size() / 2; k < path.intervals.size(); ++k) path.intervals[k] = slippery.intervals[k];
  const double a = kFirm * kGravity * (kMass + kFootMass) / kMass, b = a * kSlippery / kFirm;
  const double speed_at_half = std::sqrt(b * kDistance_m);
  const double peak = std::sqrt(0.5 * (a * kDistance_m + speed_at_half * speed_at_half));
  const double expected_s = peak / a + (peak - speed_at_half) / a + speed_at_half / b;
  EXPECT_NEAR(ShortestDuration_s(path), expected_s, 2.0 * kAccuracy * expected_s);
}

TEST(TimeLaw, JoinedSetsHoldAtBothEnds) {
  const RobotModel robot = Carrier("prismatic", "1 0 0", 1e3, 0.5);
  const StanceForces forces = Ground(0.5, 3);
  std::vector<Eigen::VectorXd> points(3, robot.NeutralConfiguration());
  for (size_t i = 0; i < points.size(); ++i) points[i][0] = 0.1 * static_cast<double>(i * i);
  const PathSpline spline({0.0, 1.0, 2.0}, points);
  PhaseSetBuilder builder(robot, kGravity);
  CurvePoint point;
  std::vector<PhaseSet> sets;
  const std::vector<double> grid = {0.9, 1.1};
  for (const double s : grid) {
    spline.Evaluate(s, &point);
    sets.push_back(builder.Compute(forces, point, 0.0));
  }
  const PathLimits path = JoinSets(grid, sets);
  const auto contains = [](const PhaseSet& set, double u, double x) {
    return std::ranges::all_of(set.edges, [&](const PhaseEdge& e) { return e.a * u + e.b * x <= e.c + 1e-5; });
  };
  int inside = 0;
  for (const Eigen::Vector2d& corner : path.intervals.front().corners) {
    EXPECT_TRUE(contains(sets[0], corner.x(), corner.y()));
    EXPECT_TRUE(contains(sets[1], corner.x(), corner.y() + 2.0 * 0.2 * corner.x()));
    ++inside;
  }
  EXPECT_GE(inside, 3);
}

}  // namespace
}  // namespace legopt
