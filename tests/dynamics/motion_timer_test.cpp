// Durations of whole motions: the planted motions of the embedded quadruped, and motions at rest.
#include "legopt/dynamics/motion_timer.h"

#include <gtest/gtest.h>

#include <cmath>

#include "legopt/types/input_error.h"
#include "tests/dynamics/planted_motions.h"

namespace legopt {
namespace {

using MotionTimerTest = PlantedMotions;
using Motion = PlantedMotion;

TEST_F(MotionTimerTest, PlantedMotionsHaveTimeLawsInTheRightOrder) {
  int finite = 0;
  for (const SolvedProblem& solved : file_.problems) {
    const Motion motion = MotionOf(solved);
    const MotionTiming timing = Time(motion);
    if (std::isinf(timing.shortest_s)) {
      EXPECT_FALSE(timing.blocked_by.empty()) << solved.definition.id;
      EXPECT_GE(timing.blocked_at, 0.0);
      continue;
    }
    ++finite;
    EXPECT_LE(timing.shortest_s, timing.greedy_s);
    EXPECT_GE(timing.reduced_s, timing.shortest_s);
    for (const double share : {timing.limits.velocity, timing.limits.torque, timing.limits.contact}) {
      EXPECT_LE(share, 1.0) << "also after rounding";
    }
    EXPECT_NEAR(timing.limits.velocity + timing.limits.torque + timing.limits.contact, 1.0, 1e-9);
    ASSERT_EQ(timing.times_s.size(), timing.parameters.size());
    EXPECT_NEAR(timing.times_s.back(), timing.shortest_s, 1e-9 * timing.shortest_s);
    for (size_t k = 1; k < timing.times_s.size(); ++k) EXPECT_GT(timing.times_s[k], timing.times_s[k - 1]);
    EXPECT_EQ(timing.parameters.back(), static_cast<double>(motion.stances.size() - 1));
  }
  EXPECT_GE(finite, 15) << "16 of 20 when this was written";
}

TEST_F(MotionTimerTest, MotionAtRestTakesNoTime) {
  Motion motion = MotionOf(file_.problems.front());
  const Eigen::VectorXd rest = motion.path.points.front();
  for (size_t i = 0; i < motion.path.points.size(); ++i) {
    motion.path.points[i] = rest;
    if (i % 2 == 1) motion.path.points[i].tail<4>() *= -1.0;  // the same orientation
  }
  const MotionTiming timing = Time(motion);
  EXPECT_EQ(timing.shortest_s, 0.0);
  EXPECT_EQ(timing.reduced_s, 0.0);
}

TEST_F(MotionTimerTest, RefusesBadMotions) {
  const Motion motion = MotionOf(file_.problems.front());
  const auto message = [](const Motion& bad) -> std::string {
    try {
      Time(bad);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  Motion bad = motion;
  bad.stances.resize(1);
  EXPECT_NE(message(bad).find("at least two waypoints"), std::string::npos) << message(bad);
  bad = motion;
  bad.path.points.pop_back();
  EXPECT_NE(message(bad).find("each time"), std::string::npos) << message(bad);
  bad = motion;
  bad.path.times[1] = bad.path.times[2];
  EXPECT_NE(message(bad).find("increase"), std::string::npos) << message(bad);
  bad = motion;
  for (double& time : bad.path.times) time = time == 1.0 ? 1.01 : time;
  EXPECT_NE(message(bad).find("include each waypoint"), std::string::npos) << message(bad);
  bad = motion;
  bad.path.points[1].tail<4>().setZero();
  EXPECT_NE(message(bad).find("quaternion 0"), std::string::npos) << message(bad);
  bad = motion;
  bad.path.points[1][0] = 1e300;
  EXPECT_NE(message(bad).find("above 1e6"), std::string::npos) << message(bad);
  bad = motion;
  bad.path.points[1][0] = std::nan("");
  EXPECT_NE(message(bad).find("not finite"), std::string::npos) << message(bad);
  bad = motion;
  bad.path.points[1].conservativeResize(3);
  EXPECT_NE(message(bad).find("3 numbers"), std::string::npos) << message(bad);
  bad = motion;
  bad.path.times.back() += 0.5;
  EXPECT_NE(message(bad).find("include each waypoint"), std::string::npos) << message(bad);
}

TEST_F(MotionTimerTest, StanceWithoutContactsBlocks) {
  const Motion motion = MotionOf(file_.problems.front());
  Motion flight = motion;
  const Stance none;
  flight.stances[3] = &none;
  const MotionTiming timing = Time(flight);
  EXPECT_TRUE(std::isinf(timing.shortest_s));
  EXPECT_EQ(timing.blocked_by, "no contact");
}

}  // namespace
}  // namespace legopt
