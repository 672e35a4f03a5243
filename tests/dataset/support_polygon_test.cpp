#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "legopt/dataset/contact.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"

namespace legopt {
namespace {

using Points = std::vector<Eigen::Vector2d>;

double SignedArea(const Points& polygon) {
  double twice = 0;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d& a = polygon[i];
    const Eigen::Vector2d& b = polygon[(i + 1) % polygon.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return twice / 2;
}

TEST(SupportPolygon, HullIsCounterClockwiseWithoutCollinearOrRepeatedPoints) {
  const Points hull = ConvexHull2d({{0, 0}, {2, 0}, {1, 0}, {2, 1}, {0, 1}, {1, 0.5}, {0, 0}, {2, 1}});
  EXPECT_EQ(hull.size(), 4u);
  EXPECT_DOUBLE_EQ(SignedArea(hull), 2);
}

TEST(SupportPolygon, RandomPointsAreAllInside) {
  std::mt19937_64 generator(3);
  const auto number = [&] { return std::ldexp(static_cast<double>(generator() >> 11), -53); };
  for (int trial = 0; trial < 50; ++trial) {
    Points points;
    for (int i = 0; i < 30; ++i) points.emplace_back(number(), number());
    const Points hull = ConvexHull2d(points);
    EXPECT_GT(SignedArea(hull), 0);
    for (const Eigen::Vector2d& point : points) EXPECT_LE(SignedDistanceToPolygon(hull, point), 1e-15);
    EXPECT_GT(SignedDistanceToPolygon(hull, {2, 2}), 1);
  }
}

TEST(SupportPolygon, NearlyEqualCornersMakeNoEdgeOfRoundingErrors) {
  const Points hull = ConvexHull2d({{0, 0}, {1e-16, -1e-16}, {1, 0}, {1, 1}, {1 + 1e-16, 1 - 1e-16}, {0, 1}});
  EXPECT_EQ(hull.size(), 4u);
  EXPECT_NEAR(SignedDistanceToPolygon(hull, {0.5, 0.4}), -0.4, 1e-12);
}

TEST(SupportPolygon, CollapsedPolygonsStillMeasureDistance) {
  const Points segment = ConvexHull2d({{0, 0}, {1, 0}, {0.5, 0}});
  ASSERT_EQ(segment.size(), 2u);
  EXPECT_NEAR(SignedDistanceToPolygon(segment, {0.5, 0.2}), 0.2, 1e-15);
  EXPECT_NEAR(SignedDistanceToPolygon(segment, {1.3, 0}), 0.3, 1e-15);
  EXPECT_NEAR(SignedDistanceToPolygon(segment, {0.5, 0}), 0, 1e-15);
  EXPECT_NEAR(SignedDistanceToPolygon(ConvexHull2d({{1, 1}, {1, 1}}), {1, 1.5}), 0.5, 1e-15);
}

TEST(SupportPolygon, UsesTheLowerCornersAtTheFootPose) {
  // A foot tilted by 30 degrees about y: the sole is 0.1 below the frame, so its corners move by 0.1 sin(30) in x.
  const Contact sole =
      ResolveContact({}, 0, Eigen::AlignedBox3d(Eigen::Vector3d(-0.1, -0.05, -0.1), Eigen::Vector3d(0.2, 0.05, 5)));
  ContactPlacement foot{.contact = &sole, .X_WL = Eigen::Isometry3d::Identity(), .normal_W = Eigen::Vector3d::UnitZ()};
  const double tilt = std::numbers::pi / 6;
  foot.X_WL = Eigen::Translation3d(1, 2, 3) * Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitY());
  const Points polygon = SupportPolygon({&foot, 1});
  ASSERT_EQ(polygon.size(), 4u);
  double low = 1e9, high = -1e9;
  for (const Eigen::Vector2d& corner : polygon) {
    low = std::min(low, corner.x());
    high = std::max(high, corner.x());
  }
  EXPECT_NEAR(low, 1 - 0.1 * std::cos(tilt) - 0.1 * std::sin(tilt), 1e-12);
  EXPECT_NEAR(high, 1 + 0.2 * std::cos(tilt) - 0.1 * std::sin(tilt), 1e-12);
}

TEST(SupportPolygon, TargetPolygonOfTheSyntheticStance) {
  const test::TemporaryFolder folder;
  const auto dataset = Dataset::Load(test::SyntheticFolder(folder.path()).path());
  const ProblemDefinition& problem = dataset->problem(Task::kPosture, 0);
  const Points polygon = TargetSupportPolygon(*dataset, problem.stances[0]);
  EXPECT_EQ(polygon.size(), 4u);
  EXPECT_NEAR(SignedArea(polygon), 0.2 * 0.3, 1e-12);
  EXPECT_NEAR(SignedDistanceToPolygon(polygon, {0.03, 0}), -0.1, 1e-12);
  EXPECT_NEAR(SignedDistanceToPolygon(polygon, {0.14, 0}), 0.01, 1e-12);
}

}  // namespace
}  // namespace legopt
