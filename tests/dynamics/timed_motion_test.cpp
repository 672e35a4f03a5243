// States of a robot in a timed motion: derivatives against finite differences, forces and torques against the equations
// of motion, limits, and the phases of its contacts.
#include "legopt/dynamics/timed_motion.h"

#include <Eigen/Geometry>
#include <cmath>
#include <optional>

#include "legopt/dataset/contact.h"
#include "legopt/robot/configuration.h"
#include "tests/dynamics/planted_motions.h"

namespace legopt {
namespace {

class TimedMotionTest : public PlantedMotions {
 protected:
  TimedMotionTest() : motion_(MotionOf(file_.problems.front())) {
    timed_.emplace(*dataset_, Time(motion_), motion_.stances, motion_.path.times, motion_.path.points);
  }

  double weight_N() const { return dataset_->robot().total_mass() * dataset_->gravity_m_s2(); }
  /// Middle of an interval of the grid.
  double Middle(size_t k) const { return 0.5 * (timed_->timing().times_s[k] + timed_->timing().times_s[k + 1]); }
  /// Indices of intervals all over the motion.
  std::vector<size_t> SomeIntervals() const {
    std::vector<size_t> some;
    for (size_t k = 3; k + 1 < timed_->timing().times_s.size(); k += 29) some.push_back(k);
    return some;
  }
  Eigen::Vector3d ComAt(double time_s) {
    Kinematics kinematics(dataset_->robot());
    kinematics.Update(timed_->At(time_s).x);
    return kinematics.com();
  }

  PlantedMotion motion_;
  std::optional<TimedMotion> timed_;
};

TEST_F(TimedMotionTest, DerivativesAreThoseOfFiniteDifferences) {
  constexpr double kStep_s = 1e-5, kTolerance = 1e-4;
  for (const size_t k : SomeIntervals()) {
    const MotionSample before = timed_->At(Middle(k) - kStep_s), here = timed_->At(Middle(k)),
                       after = timed_->At(Middle(k) + kStep_s);
    const auto from = PartsOf(before.x), to = PartsOf(after.x);
    Eigen::VectorXd velocity(here.velocity.size());
    velocity << (to.linear() - from.linear()) / (2.0 * kStep_s),
        2.0 * (to.base_rotation() * from.base_rotation().conjugate()).vec() / (2.0 * kStep_s);
    EXPECT_LT((velocity - here.velocity).norm(), kTolerance * (1.0 + here.velocity.norm())) << k;
    const Eigen::VectorXd acceleration = (after.velocity - before.velocity) / (2.0 * kStep_s);
    EXPECT_LT((acceleration - here.acceleration).norm(), kTolerance * (1.0 + here.acceleration.norm())) << k;
  }
}

TEST_F(TimedMotionTest, ForcesAccelerateTheCentreOfMass) {
  constexpr double kStep_s = 1e-4;
  for (const size_t k : SomeIntervals()) {
    const Eigen::Vector3d acceleration =
        (ComAt(Middle(k) + kStep_s) - 2.0 * ComAt(Middle(k)) + ComAt(Middle(k) - kStep_s)) / (kStep_s * kStep_s);
    const MotionSample sample = timed_->At(Middle(k));
    Eigen::Vector3d sum_N = -weight_N() * Eigen::Vector3d::UnitZ();
    for (const ContactForce& force : sample.forces) sum_N += force.force_N;
    const double residual = (sum_N - dataset_->robot().total_mass() * acceleration).cwiseAbs().maxCoeff() / weight_N();
    EXPECT_LT(residual, sample.imbalance + 1e-4) << k;
  }
}

TEST_F(TimedMotionTest, TorquesAreThoseOfInverseDynamicsWithTheForces) {
  const RobotModel& robot = dataset_->robot();
  Kinematics kinematics(robot);
  InverseDynamics dynamics(robot);
  InertialForces inertial;
  Eigen::MatrixXd jacobian(3, robot.tangent_size());
  Eigen::VectorXd torques(robot.num_dofs());
  for (const size_t k : SomeIntervals()) {
    const MotionSample sample = timed_->At(Middle(k));
    kinematics.Update(sample.x);
    dynamics.Compute(kinematics, sample.velocity, sample.acceleration, &inertial);
    kinematics.GravityTorques(dataset_->gravity_m_s2(), torques);
    torques += inertial.torques;
    Eigen::Vector3d moment_Nm = -inertial.moment_Nm;
    for (const ContactForce& force : sample.forces) {
      kinematics.PointJacobian(force.link, force.position_W, jacobian);
      torques -= jacobian.leftCols(robot.num_dofs()).transpose() * force.force_N;
      moment_Nm += (force.position_W - kinematics.com()).cross(force.force_N);
    }
    EXPECT_LT((torques - sample.torques).cwiseAbs().maxCoeff(), 1e-8 * weight_N()) << k;
    EXPECT_LT(moment_Nm.cwiseAbs().maxCoeff(), (sample.imbalance + 1e-9) * weight_N()) << k;
  }
}

TEST_F(TimedMotionTest, LimitsHoldAtTheGridAndNearlyBetweenItsPoints) {
  const RobotModel& robot = dataset_->robot();
  double grid_torque = 0.0, grid_speed = 0.0, grid_imbalance = 0.0, torque = 0.0, speed = 0.0, imbalance = 0.0;
  const std::vector<double>& times = timed_->timing().times_s;
  const auto measure = [&](double time_s, double* largest_torque, double* largest_speed, double* largest_imbalance) {
    const MotionSample sample = timed_->At(time_s);
    const auto shares = [&](const Eigen::VectorXd& values, const Eigen::VectorXd& limits) {
      return (values.head(robot.num_dofs()).array() / limits.array()).abs().maxCoeff();
    };
    *largest_torque = std::max(*largest_torque, shares(sample.torques, robot.effort_limits()));
    *largest_speed = std::max(*largest_speed, shares(sample.velocity, robot.velocity_limits()));
    *largest_imbalance = std::max(*largest_imbalance, sample.imbalance);
  };
  for (size_t k = 0; k < times.size(); ++k) {
    measure(times[k], &grid_torque, &grid_speed, &grid_imbalance);
    if (k + 1 < times.size()) measure(Middle(k), &torque, &speed, &imbalance);
  }
  EXPECT_LE(grid_torque, 1.0 + 1e-4);
  EXPECT_LE(grid_speed, 1.0 + 1e-4);
  EXPECT_LE(grid_imbalance, MotionTimer::kCurveSlack * (1.0 + 1e-3));
  EXPECT_GT(std::max(grid_torque, grid_speed), 0.5) << "the shortest motion uses its limits";
  EXPECT_LE(torque, 1.1);
  EXPECT_LE(speed, 1.1);
  EXPECT_LE(imbalance, 0.01) << "also after waypoints where contacts end";
}

TEST_F(TimedMotionTest, ForcesStayInTheirFrictionCones) {
  for (const size_t k : SomeIntervals()) {
    const MotionSample sample = timed_->At(Middle(k));
    ASSERT_FALSE(sample.forces.empty());
    const Stance& stance = *motion_.stances[static_cast<size_t>(sample.parameter)];
    for (const ContactForce& force : sample.forces) {
      const auto target = std::ranges::find(stance.contacts, force.contact, &ContactTarget::contact);
      ASSERT_NE(target, stance.contacts.end());
      EXPECT_LT((force.normal_W - NormalOf(*target)).norm(), 1e-12);
      const double normal_N = force.force_N.dot(force.normal_W);
      ASSERT_TRUE(force.friction);
      EXPECT_EQ(*force.friction, target->friction.value_or(dataset_->contact(force.contact).friction));
      EXPECT_GE(normal_N, -1e-6);
      EXPECT_LE((force.force_N - normal_N * force.normal_W).norm(), *force.friction * normal_N + 1e-6);
    }
  }
}

TEST_F(TimedMotionTest, BeginsAndEndsAtRest) {
  EXPECT_EQ(timed_->At(0.0).velocity.norm(), 0.0);
  const MotionSample end = timed_->At(timed_->duration_s());
  EXPECT_EQ(end.velocity.norm(), 0.0);
  EXPECT_EQ(end.acceleration.norm(), 0.0);
  EXPECT_EQ(end.parameter, static_cast<double>(motion_.stances.size() - 1));
  EXPECT_LT((end.x.head(end.x.size() - 4) - motion_.path.points.back().head(end.x.size() - 4)).norm(), 1e-9);
}

TEST_F(TimedMotionTest, StatesDoNotDependOnTheCallsBefore) {
  const MotionSample first = timed_->At(Middle(40));
  timed_->At(Middle(3));
  const MotionSample again = timed_->At(Middle(40));
  EXPECT_EQ(first.x, again.x);
  EXPECT_EQ(first.torques, again.torques);
  for (size_t k = 0; k < first.forces.size(); ++k) EXPECT_EQ(first.forces[k].force_N, again.forces[k].force_N);
}

TEST_F(TimedMotionTest, PhasesCoverTheMotionAndNameContactsThatStay) {
  const std::vector<MotionPhase> phases = timed_->Phases();
  ASSERT_GT(phases.size(), 2u);
  EXPECT_EQ(phases.back().end_s, timed_->duration_s());
  for (size_t i = 0; i < phases.size(); ++i) {
    EXPECT_GT(phases[i].end_s, phases[i].begin_s);
    EXPECT_EQ(phases[i].begin_s, i > 0 ? phases[i - 1].end_s : 0.0);
    const MotionSample sample = timed_->At(0.5 * (phases[i].begin_s + phases[i].end_s));
    for (const ContactForce& force : sample.forces) {
      EXPECT_TRUE(std::ranges::any_of(phases[i].contacts.contacts,
                                      [&](const ContactTarget& target) { return target.contact == force.contact; }))
          << force.contact << " in phase " << i;
    }
  }
}

TEST(SampleTimes, EndAtTheDurationAndAreLimited) {
  EXPECT_EQ(SampleTimes(0.25, 10.0, 100), (std::vector<double>{0.0, 0.1, 0.2, 0.25}));
  EXPECT_EQ(SampleTimes(0.2, 10.0, 100).size(), 3u) << "the end is no second sample";
  const std::vector<double> few = SampleTimes(10.0, 100.0, 5);
  ASSERT_EQ(few.size(), 5u);
  EXPECT_EQ(few.back(), 10.0);
  EXPECT_DOUBLE_EQ(few[1], 2.5);
}

}  // namespace
}  // namespace legopt
