#include "legopt/dynamics/path_spline.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>
#include <random>

#include "legopt/robot/configuration.h"

namespace legopt {
namespace {

constexpr Eigen::Index kJoints = 3;

std::vector<Eigen::VectorXd> RandomPoints(int number) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  std::vector<Eigen::VectorXd> points;
  for (int i = 0; i < number; ++i) {
    Eigen::VectorXd x(kJoints + 7);
    for (double& value : x) value = normal(random);
    x.tail<4>() += Eigen::Vector4d(4, 0, 0, 0);
    if (i % 2 == 1) x.tail<4>() *= -2.0;  // sign and length of a quaternion say nothing
    points.push_back(x);
  }
  return points;
}

const std::vector<double> kTimes = {0.0, 0.5, 1.0, 1.25, 2.0, 3.0};

TEST(PathSpline, PassesThroughItsPoints) {
  const std::vector<Eigen::VectorXd> points = RandomPoints(6);
  const PathSpline spline(kTimes, points);
  CurvePoint at;
  for (size_t i = 0; i < points.size(); ++i) {
    spline.Evaluate(kTimes[i], &at);
    EXPECT_LT((at.x.head(kJoints + 3) - points[i].head(kJoints + 3)).norm(), 1e-14);
    EXPECT_NEAR(std::abs(at.x.tail<4>().dot(points[i].tail<4>().normalized())), 1.0, 1e-14);
  }
  spline.Evaluate(0.0, &at);
  EXPECT_LT(at.bend.head(kJoints + 3).norm(), 1e-12) << "natural end";
  spline.Evaluate(3.0, &at);
  EXPECT_LT(at.bend.head(kJoints + 3).norm(), 1e-12) << "natural end";
}

TEST(PathSpline, DerivativesAreThoseOfTheCurve) {
  constexpr double kStep = 1e-5;
  const PathSpline spline(kTimes, RandomPoints(6));
  CurvePoint at, after, before;
  for (const double s : {0.2, 0.5, 0.77, 1.1, 1.25, 2.6}) {
    spline.Evaluate(s, &at);
    spline.Evaluate(s + kStep, &after);
    spline.Evaluate(s - kStep, &before);
    const Eigen::Index linear = kJoints + 3;
    EXPECT_LT((at.velocity.head(linear) - (after.x - before.x).head(linear) / (2 * kStep)).norm(), 1e-7) << s;
    const Eigen::Quaterniond turn = PartsOf(after.x).base_rotation() * PartsOf(before.x).base_rotation().conjugate();
    const Eigen::Vector3d spin = 2.0 * std::copysign(1.0, turn.w()) * turn.vec() / (2 * kStep);
    EXPECT_LT((at.velocity.tail<3>() - spin).norm(), 1e-7) << s;
    // At a point of the path the third derivative jumps.
    EXPECT_LT((at.bend - (after.velocity - before.velocity) / (2 * kStep)).norm(), 1e-2) << s << ": continuous bends";
  }
}

TEST(PathSpline, LineIsALine) {
  std::vector<Eigen::VectorXd> points(3, Eigen::VectorXd::Zero(kJoints + 7));
  for (size_t i = 0; i < points.size(); ++i) {
    points[i][0] = static_cast<double>(i) * 0.4;
    points[i].tail<4>() << 1, 0, 0, 0;
  }
  const PathSpline spline({0.0, 1.0, 2.0}, points);
  CurvePoint at;
  spline.Evaluate(1.3, &at);
  EXPECT_NEAR(at.x[0], 0.52, 1e-15);
  EXPECT_NEAR(at.velocity[0], 0.4, 1e-15);
  EXPECT_NEAR(at.bend.norm(), 0.0, 1e-14);
}

}  // namespace
}  // namespace legopt
