// The metric of CHOMP and STOMP on chains of waypoints, and their projection onto equalities.
#include "legopt/solvers/internal/waypoint_metric.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "tests/solvers/analytic_program.h"

namespace legopt {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

TEST(WaypointMetric, IsTheInverseOfTheSmoothedIdentityAndKeepsCommonChanges) {
  constexpr int kWaypoints = 4, kBlock = 3;
  constexpr double kSmoothness = 7.0;
  WaypointMetric metric;
  metric.Reset(kWaypoints, kBlock, kSmoothness, Differences::kVelocities);
  VectorXd v = VectorXd::LinSpaced(kWaypoints * kBlock, -1.0, 2.0).array().sin();
  const VectorXd original = v;
  metric.ApplyInverse(v);
  for (int t = 0; t < kWaypoints; ++t) {  // A v, row by row
    VectorXd row = v.segment(t * kBlock, kBlock);
    for (const int other : {t - 1, t + 1}) {
      if (other < 0 || other >= kWaypoints) continue;
      row += kSmoothness * (v.segment(t * kBlock, kBlock) - v.segment(other * kBlock, kBlock));
    }
    EXPECT_LT((row - original.segment(t * kBlock, kBlock)).norm(), 1e-12);
  }
  VectorXd common = VectorXd::Constant(kWaypoints * kBlock, 0.3);
  metric.ApplyInverse(common);
  EXPECT_LT((common.array() - 0.3).abs().maxCoeff(), 1e-12);
  metric.Reset(1, kBlock, kSmoothness, Differences::kAccelerations);
  VectorXd alone = VectorXd::LinSpaced(kBlock, 1, 3);
  const VectorXd before = alone;
  metric.ApplyInverse(alone);
  metric.Correlate(alone);
  metric.Smooth(alone);
  EXPECT_EQ(alone, before);
}

// Metric of accelerations on the chain, by the definition.
MatrixXd AccelerationMetric(int waypoints, double smoothness) {
  MatrixXd k = MatrixXd::Zero(waypoints - 2, waypoints);
  for (int t = 0; t + 2 < waypoints; ++t) k.row(t).segment(t, 3) << 1.0, -2.0, 1.0;
  return MatrixXd::Identity(waypoints, waypoints) + smoothness * k.transpose() * k;
}

// Applies Correlate and Smooth to unit vectors, one column each.
MatrixXd ColumnsOf(WaypointMetric& metric, int waypoints, void (WaypointMetric::*map)(VectorXd&)) {
  MatrixXd columns(waypoints, waypoints);
  for (int t = 0; t < waypoints; ++t) {
    VectorXd unit = VectorXd::Unit(waypoints, t);
    (metric.*map)(unit);
    columns.col(t) = unit;
  }
  return columns;
}

TEST(WaypointMetric, NoiseHasTheCovarianceOfAccelerationsScaledToOne) {
  constexpr int kWaypoints = 6;
  for (const bool first_fixed : {false, true}) {
    WaypointMetric metric;
    metric.Reset(kWaypoints, 1, 10.0, Differences::kAccelerations, first_fixed);
    const MatrixXd root = ColumnsOf(metric, kWaypoints, &WaypointMetric::Correlate);
    const MatrixXd covariance = root * root.transpose();
    const int free = first_fixed ? kWaypoints - 1 : kWaypoints;
    MatrixXd expected = MatrixXd::Zero(kWaypoints, kWaypoints);
    expected.bottomRightCorner(free, free) =
        AccelerationMetric(kWaypoints, 10.0).bottomRightCorner(free, free).inverse();
    expected /= expected.diagonal().maxCoeff();
    EXPECT_LT((covariance - expected).norm(), 1e-12);
    const MatrixXd smoother = ColumnsOf(metric, kWaypoints, &WaypointMetric::Smooth);
    for (int t = kWaypoints - free; t < kWaypoints; ++t) {
      EXPECT_NEAR(smoother.col(t).cwiseAbs().maxCoeff(), 1.0 / free, 1e-12);
      EXPECT_LT((smoother.col(t).normalized() - expected.col(t).normalized()).norm(), 1e-12);
    }
    EXPECT_EQ(smoother.row(0).isZero(), first_fixed);
  }
}

// A chain of three points in space: the first fixed, the second on a sphere, the third on a sphere and a plane.
class Projection : public ::testing::Test {
 protected:
  Projection() : program_(VectorXd::Constant(9, -3), Upper(), 3) {
    const auto sphere = [](const VectorXd& x) { return One(x.squaredNorm() - 1.0); };
    program_.AddShaped({"sphere", TermKind::kEquality, 1}, sphere);
    program_.AddShaped({"sphere", TermKind::kEquality, 2}, sphere);
    program_.AddShaped({"plane", TermKind::kEquality, 2}, [](const VectorXd& x) { return One(x[2] - 0.5); });
    program_.AddShaped({"inequality", TermKind::kInequality, 1}, [](const VectorXd& x) { return One(x[0]); });
    x_ = VectorXd::Zero(9);
    x_ << -3, -3, -3, 0.6, 0.0, 0.8, 0.0, std::sqrt(0.75), 0.5;
    program_.StepBounds(x_, lower_, upper_);
    projection_.Reset(program_);
  }

  static VectorXd Upper() {
    VectorXd upper = VectorXd::Constant(9, 3);
    upper.head(3).setConstant(-3);
    return upper;
  }

  double LargestResidual(const VectorXd& point) {
    return std::max({std::abs(point.segment(3, 3).squaredNorm() - 1.0), std::abs(point.tail(3).squaredNorm() - 1.0),
                     std::abs(point[8] - 0.5)});
  }

  AnalyticProgram program_;
  EqualityProjection projection_;
  VectorXd x_, lower_ = VectorXd::Zero(9), upper_ = VectorXd::Zero(9);
};

TEST_F(Projection, EndsOnTheConstraintsAndLeavesTheFixedAlone) {
  VectorXd dx = VectorXd::LinSpaced(9, -0.4, 0.3), point(9);
  dx.head(3).setZero();
  projection_.Project(program_, x_, lower_, upper_, dx, point);
  EXPECT_LT(LargestResidual(point), 1e-5);
  EXPECT_EQ(point, x_ + dx);
  EXPECT_TRUE(dx.head(3).isZero());
}

TEST_F(Projection, StaysWithinTheBounds) {
  lower_.tail(6).setConstant(-0.05);
  upper_.tail(6).setConstant(0.2);
  VectorXd dx = VectorXd::Zero(9), point(9);
  dx.tail(6) << 0.2, 0.2, -0.05, 0.2, 0.0, 0.2;
  projection_.Project(program_, x_, lower_, upper_, dx, point);
  EXPECT_TRUE((dx.array() >= lower_.array() && dx.array() <= upper_.array()).all());
  EXPECT_LT(LargestResidual(point), 1e-5);
}

TEST_F(Projection, TangentsLeaveTheConstraintsInSecondOrderOnly) {
  WaypointMetric metric;
  metric.Reset(3, 3, 10.0, Differences::kVelocities, true);
  projection_.Linearize(program_, x_, lower_, upper_, metric);
  VectorXd v = VectorXd::LinSpaced(9, -10.0, 10.0);
  metric.ApplyInverse(v);
  projection_.MakeTangent(v);
  ASSERT_GT(v.norm(), 0.1);
  constexpr double kSmall = 1e-4;
  EXPECT_LT(LargestResidual(x_ + kSmall * v), 1e-7);
  // It is a projection: tangent vectors are unchanged.
  VectorXd again = v;
  projection_.MakeTangent(again);
  EXPECT_LT((again - v).norm(), 1e-7);
}

TEST_F(Projection, WhatIsNotFiniteIsLeftAlone) {
  AnalyticProgram program(VectorXd::Constant(2, -3), VectorXd::Constant(2, 3));
  program.Add(TermKind::kEquality, [](const VectorXd& x) { return One(std::sqrt(x[0])); });
  projection_.Reset(program);
  VectorXd dx = Vector2d(-0.5, 0.1), point(2);
  projection_.Project(program, Vector2d(0.2, 0.0), Vector2d(-3, -3), Vector2d(3, 3), dx, point);
  EXPECT_EQ(dx, Vector2d(-0.5, 0.1));
  EXPECT_EQ(point, Vector2d(-0.3, 0.1));
}

}  // namespace
}  // namespace legopt
