// Policy: numbers that do not form a path are refused with the number of the point and the requirement.
#include <gtest/gtest.h>

#include <cmath>
#include <initializer_list>
#include <limits>

#include "legopt/judge/internal/path_examiner.h"
#include "legopt/types/task.h"

namespace legopt {
namespace {

constexpr int kSize = 7;  // size of a configuration

/// Returns points at these times with distinct configurations.
std::vector<Eigen::VectorXd> Points(std::initializer_list<double> times) {
  std::vector<Eigen::VectorXd> points;
  for (const double time : times) {
    points.emplace_back(Eigen::VectorXd::Constant(kSize + 1, static_cast<double>(points.size())));
    points.back()[kSize] = time;
  }
  return points;
}

PathDiagnostic FaultOf(const std::vector<Eigen::VectorXd>& points, int num_waypoints) {
  TimedPath path;
  const auto fault = ParsePath(points, num_waypoints, kSize, &path);
  if (!fault) {
    ADD_FAILURE() << "no fault";
    return {};
  }
  return *fault;
}

void ExpectFault(const PathDiagnostic& fault, Verdict verdict, int waypoint, const std::string& detail) {
  EXPECT_EQ(ToString(fault.verdict), ToString(verdict));
  EXPECT_EQ(fault.waypoint, waypoint);
  EXPECT_EQ(fault.detail, detail);
}

TEST(TimedPath, IsTakenApartAndPutTogetherAgain) {
  const std::vector<Eigen::VectorXd> points = Points({0, 0.25, 1, 2, 2.5, 2.75, 3});
  TimedPath path;
  ASSERT_FALSE(ParsePath(points, 4, kSize, &path));
  EXPECT_EQ(path.times, (std::vector<double>{0, 0.25, 1, 2, 2.5, 2.75, 3}));
  EXPECT_EQ(path.waypoints, (std::vector<std::size_t>{0, 2, 3, 6}));
  for (std::size_t i = 0; i < points.size(); ++i) EXPECT_EQ(path.points[i], points[i].head(kSize));
  EXPECT_EQ(FormatPath(path), points);
}

TEST(TimedPath, LeadsThroughWaypointsAtEqualTimes) {
  const auto at = [](double x) { return Eigen::VectorXd(Eigen::VectorXd::Constant(2, x)); };
  const std::vector<Eigen::VectorXd> waypoints = {at(0), at(1), at(2)};
  const std::vector<std::vector<Eigen::VectorXd>> ways = {{}, {at(5), at(6), at(7)}};
  const TimedPath path = MakePath(waypoints, ways);
  EXPECT_EQ(path.times, (std::vector<double>{0, 1, 1.25, 1.5, 1.75, 2}));
  EXPECT_EQ(path.points, (std::vector<Eigen::VectorXd>{at(0), at(1), at(5), at(6), at(7), at(2)}));
}

TEST(TimedPath, OfWaypointsAloneIsOne) {
  TimedPath path;
  EXPECT_FALSE(ParsePath(Points({0, 1, 2, 3}), 4, kSize, &path));
}

TEST(TimedPath, WhoseTimeStampsDoNotIncreaseIsRefused) {
  ExpectFault(FaultOf(Points({0, 0.5, 0.5, 1}), 2), Verdict::kWrongSize, 0,
              "point 2 (time 0.5) is not later than the point before it, at 0.5");
  ExpectFault(FaultOf(Points({0, 1, 1.5, 1.25, 2}), 3), Verdict::kWrongSize, 1,
              "point 3 (time 1.25) is not later than the point before it, at 1.5");
}

TEST(TimedPath, APieceWithoutItsWaypointIsRefused) {
  ExpectFault(FaultOf(Points({0, 0.5, 1.5, 2}), 3), Verdict::kWrongSize, 0,
              "no point at waypoint 1: point 2 (time 1.5) follows that at 0.5");
  ExpectFault(FaultOf(Points({0, 2}), 3), Verdict::kWrongSize, 0,
              "no point at waypoint 1: point 1 (time 2) follows that at 0");
}

TEST(TimedPath, TooManyPiecesAreRefusedAndSoManyAreNot) {
  for (const int pieces : {kMaxPieces, kMaxPieces + 1}) {
    std::vector<Eigen::VectorXd> points;
    for (int k = 0; k <= pieces; ++k) {
      points.emplace_back(Eigen::VectorXd::Zero(kSize + 1));
      points.back()[kSize] = k / static_cast<double>(pieces);
    }
    TimedPath path;
    const auto fault = ParsePath(points, 2, kSize, &path);
    ASSERT_EQ(fault.has_value(), pieces > kMaxPieces);
    if (fault)
      ExpectFault(*fault, Verdict::kWrongSize, 0, "more than 16 pieces from waypoint 0 to the next: point 17 (time 1)");
  }
}

TEST(TimedPath, BeginsAtZeroAndEndsAtTheLastWaypoint) {
  ExpectFault(FaultOf(Points({0.5, 1}), 2), Verdict::kWrongSize, 0,
              "point 0 (time 0.5) is the first and not at time 0");
  ExpectFault(FaultOf(Points({-1, 0, 1}), 2), Verdict::kWrongSize, 0,
              "point 0 (time -1) is the first and not at time 0");
  ExpectFault(FaultOf(Points({0, 1, 1.5}), 2), Verdict::kWrongSize, 1,
              "point 2 (time 1.5) is the last and no waypoint");
}

TEST(TimedPath, WithAnotherCountOfWaypointsIsRefused) {
  ExpectFault(FaultOf(Points({0, 0.5, 1}), 4), Verdict::kWrongWaypointCount, -1, "2 waypoints instead of 4");
  ExpectFault(FaultOf(Points({0, 1, 2, 3, 4}), 4), Verdict::kWrongWaypointCount, -1, "5 waypoints instead of 4");
  ExpectFault(FaultOf({}, 4), Verdict::kWrongWaypointCount, -1, "0 waypoints instead of 4");
}

TEST(TimedPath, PointsOfOtherSizesAndTimesThatAreNoNumbersAreRefused) {
  std::vector<Eigen::VectorXd> points = Points({0, 1});
  points[1] = Eigen::VectorXd::Zero(kSize);  // a waypoint of a motion
  ExpectFault(FaultOf(points, 2), Verdict::kWrongSize, -1,
              "point 1 has 7 numbers instead of 8, a configuration and its time stamp");
  for (const double time : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    ExpectFault(FaultOf(Points({0, time, 2}), 3), Verdict::kNotFinite, -1, "the time stamp of point 1 is not finite");
  }
}

}  // namespace
}  // namespace legopt
