// Collision between waypoints: obstacles on the segment are detected, links at rest cost nothing, and the linear model
// in both end points agrees with central differences.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "legopt/problem/terms/initial_guess.h"
#include "legopt/problem/terms/internal/transition_terms.h"
#include "legopt/robot/configuration.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"
#include "tests/geometry/allocation_count.h"

namespace legopt {
namespace {

constexpr double kMargin_m = 5e-4;
constexpr double kRange_m = 0.03;

/// Two waypoints of a robot in a world and the term between them.
class Transition {
 public:
  Transition(const RobotModel& robot, std::shared_ptr<const CollisionModel> model, double range_m = kRange_m)
      : robot_(robot),
        query_(std::move(model)),
        from_(robot, query_, range_m),
        to_(robot, query_, range_m),
        term_(3, from_, to_, robot, query_, kMargin_m, range_m) {}

  void Set(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
    from_.Update(a);
    to_.Update(b);
  }
  std::vector<double> Residuals() {
    std::vector<double> residuals;
    term_.Evaluate(residuals);
    return residuals;
  }
  double Violation() {
    double sum = 0.0;
    for (const double r : Residuals()) sum += std::max(0.0, r);
    return sum;
  }
  const RobotModel& robot() const { return robot_; }
  CollisionQuery& query() { return query_; }
  WaypointState& from() { return from_; }
  WaypointState& to() { return to_; }
  SweptCollisionTerm& term() { return term_; }

 private:
  const RobotModel& robot_;
  CollisionQuery query_;
  WaypointState from_, to_;
  SweptCollisionTerm term_;
};

SceneObject BoxAt(const std::string& name, const Eigen::Vector3d& size, const Eigen::Vector3d& position) {
  SceneObject object;
  object.name = name;
  object.shape.kind = ShapeSpec::Kind::kBox;
  object.shape.size = size;
  object.shape.pose.translation() = position;
  return object;
}

constexpr double kFootHeight_m = 0.0535;

RobotModel FlyingFoot() {
  Link link;
  link.name = "foot";
  link.mass = 1.0;
  ShapeSpec box;
  box.size = {0.26, 0.13, kFootHeight_m};
  link.collision = {box};
  return RobotModel("foot", {link}, {});
}

Eigen::VectorXd FootAt(double x, double y, double z) {
  Eigen::VectorXd configuration(7);
  configuration << x, y, z, 1, 0, 0, 0;
  return configuration;
}

std::shared_ptr<const CollisionModel> World(const RobotModel& robot, const Scene& scene, SceneRepresentation which) {
  return CollisionModel::Build(robot, scene, FootAt(0, 0, 0), {.scene = which});
}

constexpr SceneRepresentation kAll[] = {SceneRepresentation::kSolid, SceneRepresentation::kSurface,
                                        SceneRepresentation::kOrientedSurface};

TEST(SweptCollision, NothingTunnelsThroughAThinWall) {
  const RobotModel robot = FlyingFoot();
  constexpr double kThin_m = 0.05;
  const Scene scene{{BoxAt("wall", {kThin_m, 3, 3}, {0, 0, 0}), BoxAt("ceiling", {3, 3, kThin_m}, {5, 0, 0})}};
  for (const SceneRepresentation which : kAll) {
    Transition transition(robot, World(robot, scene, which));
    for (double way = 0.4; way < 1.6; way += 0.037) {
      for (double shift = -0.3; shift < 0.31; shift += 0.1) {
        const double middle = shift * (way - 0.35);
        transition.Set(FootAt(middle - 0.5 * way, 0.1, 0.2), FootAt(middle + 0.5 * way, -0.1, 0.3));
        if (!transition.from().contacts().empty() || !transition.to().contacts().empty()) continue;
        EXPECT_GT(transition.Violation(), 0.0) << "through the wall, " << ToString(which) << " " << way;
        transition.Set(FootAt(5, 0, middle - 0.5 * way), FootAt(5.2, 0, middle + 0.5 * way));
        EXPECT_GT(transition.Violation(), 0.0) << "through the ceiling, flat, " << ToString(which) << " " << way;
      }
    }
  }
}

TEST(SweptCollision, ShapeOfTheTerm) {
  const RobotModel robot = FlyingFoot();
  Transition transition(robot, World(robot, {}, SceneRepresentation::kSolid));
  const TermShape& shape = transition.term().shape();
  EXPECT_EQ(shape.kind, TermKind::kInequality);
  EXPECT_EQ(shape.waypoint, 3);
  EXPECT_EQ(shape.num_waypoints, 2);
  EXPECT_TRUE(transition.Residuals().empty()) << "no configuration yet";
}

TEST(SweptCollision, NearlyStaticLinksHaveNoRows) {
  const RobotModel robot = FlyingFoot();
  const Scene scene{{BoxAt("floor", {3, 3, 1}, {0, 0, -0.5})}};
  for (const SceneRepresentation which : kAll) {
    Transition transition(robot, World(robot, scene, which));
    const double buried = 0.5 * kFootHeight_m - 0.01;
    transition.Set(FootAt(0, 0, buried), FootAt(0, 0, buried));
    EXPECT_TRUE(transition.Residuals().empty());
    transition.Set(FootAt(0, 0, buried), FootAt(0.98 * SweptCollisionTerm::kStep_m, 0, buried));
    EXPECT_TRUE(transition.Residuals().empty());
    EXPECT_EQ(transition.term().num_steps(0), 1);
    transition.Set(FootAt(0, 0, buried), FootAt(1.02 * SweptCollisionTerm::kStep_m, 0, buried));
    EXPECT_EQ(transition.term().num_steps(0), 2);
    EXPECT_FALSE(transition.Residuals().empty());
    transition.Set(FootAt(0, 0, buried), FootAt(100, 0, buried));
    EXPECT_EQ(transition.term().num_steps(0), SweptCollisionTerm::kMaxSteps);
  }
}

TEST(SweptCollision, RowsThatTheEndsDecideAreDropped) {
  const RobotModel robot = FlyingFoot();
  const Scene scene{{BoxAt("floor", {9, 9, 1}, {0, 0, -0.5})}};
  Transition transition(robot, World(robot, scene, SceneRepresentation::kSolid));
  const double hover = 0.5 * kFootHeight_m + 0.01;
  transition.Set(FootAt(0, 0, hover), FootAt(0.5, 0, hover + 0.01));
  EXPECT_TRUE(transition.Residuals().empty()) << "nowhere nearer than at its start";
}

/// Returns a kerb that a foot passes 2 cm too low.
Scene Kerb() { return {{BoxAt("kerb", {0.1, 2, 0.2}, {0, 0, 0})}}; }
constexpr double kLow = 0.1 + 0.5 * kFootHeight_m - 0.02;

TEST(SweptCollision, AFixedFirstWaypointLeavesTheSecondAUsefulGradient) {
  const RobotModel robot = FlyingFoot();
  Transition transition(robot, World(robot, Kerb(), SceneRepresentation::kSolid));
  const Eigen::VectorXd start = FootAt(-0.4, 0, kLow);
  Eigen::VectorXd end = FootAt(0.4, 0, kLow);
  for (int iteration = 0; iteration < 6; ++iteration) {
    transition.Set(start, end);
    LinearModel model;
    transition.term().Linearize(model);
    ASSERT_LE(model.rows(), 1);
    if (model.rows() == 0 || model.value(0) <= 0.0) break;
    const Eigen::Map<const Eigen::Matrix<double, 6, 1>> first(model.row(0, 0)), second(model.row(1, 0));
    EXPECT_GE(second.head<3>().norm(), first.head<3>().norm() / SweptCollisionTerm::kMaxSteps);
    EXPECT_GT(second.head<3>().norm(), 0.2) << "the obstacle is half-way";
    // A Newton step only on the second waypoint's height.
    ASSERT_LT(second[2], 0.0);
    end[2] -= model.value(0) / second[2];
  }
  transition.Set(start, end);
  EXPECT_LT(transition.Violation(), 1e-6);
  EXPECT_LT(end[2], kLow + 0.15);
}

TEST(SweptCollision, PenaltyIsContinuousWhereTheStepsAre) {
  const RobotModel robot = FlyingFoot();
  Transition transition(robot, World(robot, Kerb(), SceneRepresentation::kSolid));
  constexpr double kStep = 1e-4;
  double last = -1.0;
  int last_steps = 0;
  for (double height = kLow - 0.05; height < kLow + 0.05; height += kStep) {
    transition.Set(FootAt(-0.4, 0, height), FootAt(0.25, 0, kLow));
    const double violation = transition.Violation();
    if (last >= 0.0 && transition.term().num_steps(0) == last_steps) {
      EXPECT_NEAR(violation, last, 2 * kStep) << height;
    }
    last = violation;
    last_steps = transition.term().num_steps(0);
  }
}

/// Checks that links with short paths are skipped and that others never move more than a step between two samples.
void CheckSteps(Transition& transition, const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  transition.Set(a, b);
  const RobotModel& robot = transition.robot();
  Kinematics before(robot), after(robot);
  Eigen::VectorXd x(robot.configuration_size());
  for (int link = 0; link < static_cast<int>(robot.links().size()); ++link) {
    const CollisionModel::Ball& ball = transition.query().model().link_ball(link);
    const int steps = transition.term().num_steps(link);
    EXPECT_EQ(steps & (steps - 1), 0);
    if (ball.radius < 0.0 || steps == SweptCollisionTerm::kMaxSteps) continue;
    before.Update(a);
    for (int k = 1; k <= steps; ++k) {
      InterpolateConfiguration(a, b, static_cast<double>(k) / steps, x);
      after.Update(x);
      for (int corner = 0; corner < 6; ++corner) {
        const Eigen::Vector3d p =
            ball.centre + (corner % 2 == 0 ? 1.0 : -1.0) * ball.radius * Eigen::Vector3d::Unit(corner / 2);
        const double way = (after.link_pose(link) * p - before.link_pose(link) * p).norm();
        EXPECT_LE(way, 1.05 * SweptCollisionTerm::kStep_m) << robot.links()[static_cast<size_t>(link)].name;
      }
      std::swap(before, after);
    }
  }
}

/// Rows are comparable if the same pairs are nearest at the same places.
bool SmoothRow(const SweptCollisionTerm::Row& centre, const SweptCollisionTerm::Row& moved) {
  constexpr double kFeatureJump = 1e-4;
  return centre.s == moved.s && centre.contact.pair_id == moved.contact.pair_id &&
         (centre.contact.normal_W - moved.contact.normal_W).norm() < kFeatureJump &&
         (centre.contact.point_a_W - moved.contact.point_a_W).norm() < kFeatureJump;
}

/// Compares the linear model in both end points with central differences; returns the number of compared entries.
int CompareWithDifferences(Transition& transition, const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  constexpr double kStep = 1e-6;
  constexpr double kTolerance = 2e-6;
  const RobotModel& robot = transition.robot();
  transition.Set(a, b);
  LinearModel model;
  transition.term().Linearize(model);
  const std::vector<double> residuals = transition.Residuals();
  EXPECT_EQ(static_cast<size_t>(model.rows()), residuals.size());
  for (int i = 0; i < model.rows(); ++i) EXPECT_EQ(model.value(i), residuals[static_cast<size_t>(i)]);
  const std::span<const SweptCollisionTerm::Row> found = transition.term().rows();
  const std::vector<SweptCollisionTerm::Row> centre(found.begin(), found.end());
  int compared = 0;
  for (int end = 0; end < 2; ++end) {
    for (int j = 0; j < robot.tangent_size(); ++j) {
      std::vector<SweptCollisionTerm::Row> side[2];
      for (int k = 0; k < 2; ++k) {
        Eigen::VectorXd moved[2] = {a, b};
        const Eigen::VectorXd dx = (k == 0 ? kStep : -kStep) * Eigen::VectorXd::Unit(robot.tangent_size(), j);
        Retract(end == 0 ? a : b, dx, moved[end]);
        transition.Set(moved[0], moved[1]);
        const auto rows = transition.term().rows();
        side[k].assign(rows.begin(), rows.end());
      }
      if (side[0].size() != centre.size() || side[1].size() != centre.size()) continue;
      for (size_t i = 0; i < centre.size(); ++i) {
        if (!SmoothRow(centre[i], side[0][i]) || !SmoothRow(centre[i], side[1][i])) continue;
        const double slope = (side[1][i].contact.distance_m - side[0][i].contact.distance_m) / (2 * kStep);
        EXPECT_NEAR(model.row(end, static_cast<int>(i))[j], slope, kTolerance * std::max(1.0, std::abs(slope)))
            << "end " << end << " row " << i << " variable " << j << " s " << centre[i].s;
        ++compared;
      }
    }
  }
  return compared;
}

/// Checks that each row has one unique key, and that pairs keep theirs when their rows move.
void CheckKeys(Transition& transition) {
  const std::vector<double> residuals = transition.Residuals();
  std::vector<int> keys;
  transition.term().RowKeys(static_cast<int>(residuals.size()), keys);
  ASSERT_EQ(keys.size(), residuals.size());
  for (size_t i = 0; i < keys.size(); ++i) EXPECT_EQ(keys[i], transition.term().rows()[i].contact.pair_id);
  std::sort(keys.begin(), keys.end());
  EXPECT_EQ(std::adjacent_find(keys.begin(), keys.end()), keys.end());
  for (const double r : residuals) EXPECT_GE(r, transition.term().AbsentRow());
}

/// Checks transitions between perturbed initial guesses of successive stances, with the base rotated as well.
int CheckDataset(const Dataset& dataset, SceneRepresentation which, const std::vector<Stance>& stances,
                 double range_m) {
  std::mt19937_64 generator(21);
  Transition transition(dataset.robot(), dataset.collision_model(which), range_m);
  const int n = dataset.robot().num_dofs();
  constexpr double kNoise_rad = 0.15;
  std::vector<Eigen::VectorXd> x;
  for (const Stance& stance : stances) {
    Eigen::VectorXd start = InitialGuess(dataset, stance, Initialization::kInCollision);
    PerturbJoints(dataset.robot(), generator, kNoise_rad, start);
    Eigen::VectorXd dx = Eigen::VectorXd::Zero(dataset.robot().tangent_size());
    const double side = x.size() % 2 == 0 ? 1.0 : -1.0;
    dx.segment<6>(n) << 0.05 * side, 0.02, -0.01 * side, 0.2 * side, -0.1 * side, 0.3 * side;
    x.push_back(start);
    Retract(start, dx, x.back());
  }
  int compared = 0;
  for (size_t t = 0; t + 1 < x.size(); ++t) {
    compared += CompareWithDifferences(transition, x[t], x[t + 1]);
    CheckSteps(transition, x[t], x[t + 1]);
    CheckKeys(transition);
  }
  return compared;
}

TEST(SweptCollision, SyntheticRobotMeetsFiniteDifferences) {
  const test::TemporaryFolder temporary;
  const test::SyntheticFolder folder(temporary.path() / "dataset");
  const auto dataset = Dataset::Load(folder.path());
  const Stance& stance = dataset->problems(Task::kPosture)[0].stances[0];
  for (const SceneRepresentation which : kAll) {
    EXPECT_GT(CheckDataset(*dataset, which, std::vector<Stance>(6, stance), 0.3), 100) << ToString(which);
  }
}

TEST(SweptCollision, AtlasMeetsFiniteDifferences) {
  LEGOPT_SKIP_WITHOUT_TEST_DATA();
  const auto dataset = Dataset::Load(test::LegOptFolder());
  std::vector<Stance> stances = dataset->problems(Task::kMotion)[0].stances;
  stances.resize(6);
  for (const SceneRepresentation which : kAll) {
    EXPECT_GT(CheckDataset(*dataset, which, stances, 0.05), 1000) << ToString(which);
  }
}

TEST(SweptCollision, AllocatesNothingAfterWarmUp) {
  const RobotModel robot = FlyingFoot();
  Transition transition(robot, World(robot, Kerb(), SceneRepresentation::kSurface));
  std::vector<double> residuals;
  LinearModel model;
  const Eigen::VectorXd ends[] = {FootAt(-0.4, 0, kLow), FootAt(0.4, 0, kLow), FootAt(0, 0.3, kLow)};
  const auto run = [&] {
    for (const Eigen::VectorXd& a : ends) {
      for (const Eigen::VectorXd& b : ends) {
        transition.Set(a, b);
        residuals.clear();
        transition.term().Evaluate(residuals);
        transition.term().Linearize(model);
      }
    }
  };
  run();
  const long before = test::AllocationCount();
  run();
  EXPECT_EQ(test::AllocationCount(), before);
}

}  // namespace
}  // namespace legopt
