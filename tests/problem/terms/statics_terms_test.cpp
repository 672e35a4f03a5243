// Rows of pushes and torque limits: where they appear, and their derivatives.
#include "legopt/problem/terms/internal/statics_terms.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/problem/terms/task_program.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"
#include "tests/problem/terms/term_derivatives.h"

namespace legopt {
namespace {

TEST(Terms, PushesMeetFiniteDifferences) {
  const test::TemporaryFolder temporary;
  const test::SyntheticFolder folder(temporary.path() / "dataset");
  const auto dataset = Dataset::Load(folder.path());
  CollisionQuery query(dataset->collision_model());
  Stance stance = dataset->problems(Task::kPosture)[0].stances[0];
  stance.push_N = 20.0;
  const auto program = MakeTaskProgram(Task::kPosture, *dataset, query, {&stance, 1}, {.physics = Physics::kBalance});
  program->Keep([](const Term& term) { return term.shape().name == "push"; });
  ASSERT_EQ(program->terms().size(), 1u);
  Eigen::VectorXd x = test::Leaning(0.05);
  x[test::kBaseY] += 0.013;  // off the symmetry, where two corners of the polygon resist equally
  x[test::kLeftShoulder] = 0.4;
  program->SetPoint(x);
  std::vector<double> rows;
  program->terms()[0]->Evaluate(rows);
  // Forwards, the feet's front edge limits the push, which shifts the weight by its share times the height.
  const Eigen::Vector3d com = program->state(0).kinematics().com();
  const double weight_N = dataset->robot().total_mass() * dataset->gravity_m_s2();
  const double forwards = com.x() + com.z() * 20.5 / weight_N - 0.13;
  EXPECT_TRUE(std::ranges::any_of(rows, [&](double row) { return std::abs(row - forwards) < 2e-3; }));
  TermDerivatives(*program).CheckAt(x);
  x[test::kBaseX] += 1.0;
  program->SetPoint(x);
  rows.clear();
  program->terms()[0]->Evaluate(rows);
  ASSERT_FALSE(rows.empty());
  EXPECT_GT(*std::ranges::max_element(rows), 0.9) << "the rows lead back from places without equilibrium";
}

TEST(Terms, PushesThatNothingBalancesHaveNoRows) {
  const test::TemporaryFolder temporary;
  const test::SyntheticFolder folder(temporary.path() / "dataset");
  const auto dataset = Dataset::Load(folder.path());
  Stance stance = dataset->problems(Task::kPosture)[0].stances[0];
  stance.push_N = 1e6;  // nothing balances it
  EXPECT_TRUE(PushHalfSpaces(*dataset, stance).empty());
}

TEST(Terms, TorquesNearTheirLimitsAreRows) {
  const test::TemporaryFolder temporary;
  const test::SyntheticFolder folder(temporary.path() / "dataset");
  // Shoulders that can hold their arms hanging only, and weak ankles.
  const auto robot = folder.path() / "robot.urdf";
  for (const char* side : {"l", "r"}) {
    const std::string name(side);
    test::ReplaceInFile(
        robot,
        "<axis xyz='" + std::string(name == "l" ? "1" : "-1") + " 0 0'/><limit lower='-0.6' upper='2' effort='100'",
        "<axis xyz='" + std::string(name == "l" ? "1" : "-1") + " 0 0'/><limit lower='-0.6' upper='2' effort='1.2'");
  }
  for (int joint = 0; joint < 4; ++joint) {
    test::ReplaceInFile(robot, "lower='-1' upper='1' effort='100'", "lower='-1' upper='1' effort='2'");
  }
  WriteManifestHashes(folder.path());
  const auto dataset = Dataset::Load(folder.path());
  CollisionQuery query(dataset->collision_model());
  const auto program = MakeTaskProgram(Task::kPosture, *dataset, query, dataset->problems(Task::kPosture)[0].stances,
                                       {.physics = Physics::kEffort});
  std::vector<std::string> names;
  for (const auto& term : program->terms()) names.push_back(term->shape().name);
  EXPECT_EQ(names, (std::vector<std::string>{"torque cost", "foot l_foot", "foot r_foot", "centre of mass",
                                             "torques of free joints", "torques of loaded joints", "collision"}));
  Eigen::VectorXd x = test::Leaning(0.05);
  x[test::kLeftHip] += 0.03;
  x[test::kLeftShoulder] = 0.4;
  std::vector<double> free, loaded;
  const auto evaluate = [&] {
    free.clear();
    loaded.clear();
    program->SetPoint(x);
    program->terms()[4]->Evaluate(free);
    program->terms()[5]->Evaluate(loaded);
  };
  evaluate();
  EXPECT_FALSE(free.empty()) << "the left shoulder";
  ASSERT_EQ(loaded.size(), 1u) << "hips and ankles";
  EXPECT_GT(loaded[0], kNearEffortShare - kEffortShare);
  x[test::kBaseX] += 1.0;  // far outside of the polygon: no forces, no row
  evaluate();
  EXPECT_TRUE(loaded.empty());
  // This robot's legs have pitch joints only, so that lateral forces are free, and the ratio has a kink in the roll of
  // the base; torque_test.cpp compares its gradient on a robot with roll joints.
  program->Keep([](const Term& term) { return term.shape().name != "torques of loaded joints"; });
  x[test::kBaseX] -= 1.0;
  TermDerivatives(*program).CheckAt(x);
}

TEST(Terms, TorquesFarFromTheirLimitsHaveNoRows) {
  const test::TemporaryFolder temporary;
  const test::SyntheticFolder folder(temporary.path() / "dataset");
  const auto dataset = Dataset::Load(folder.path());
  CollisionQuery query(dataset->collision_model());
  const auto program = MakeTaskProgram(Task::kPosture, *dataset, query, dataset->problems(Task::kPosture)[0].stances,
                                       {.physics = Physics::kEffort});
  program->SetPoint(test::StandingUpright());
  std::vector<double> rows;
  program->terms()[4]->Evaluate(rows);
  program->terms()[5]->Evaluate(rows);
  EXPECT_TRUE(rows.empty());
}

/// Returns the names of the terms of one waypoint of a motion with three stances: both feet, the left foot, both feet.
std::vector<std::string> NamesAt(const Dataset& dataset, int waypoint, const ProgramOptions& options) {
  CollisionQuery query(dataset.collision_model());
  const auto program =
      MakeTaskProgram(Task::kTimed, dataset, query, dataset.problems(Task::kMotion)[0].stances, options);
  std::vector<std::string> names;
  for (const auto& term : program->terms()) {
    const TermShape& shape = term->shape();
    if (shape.waypoint == waypoint && shape.num_waypoints == 1) names.push_back(shape.name);
  }
  return names;
}

// The contacts of the second waypoint are both feet, those of the segment after it only the left one.
TEST(Terms, WaypointsKeepEffortLimitsWithTheContactsOfTheirSegments) {
  const test::TemporaryFolder temporary;
  const auto dataset = Dataset::Load(test::SyntheticFolder(temporary.path() / "dataset").path());
  const auto count = [&](const std::string& name, Physics on_segment) {
    return std::ranges::count(NamesAt(*dataset, 1, {.physics = Physics::kEffort, .segment_physics = on_segment}), name);
  };
  EXPECT_EQ(count("torques of loaded joints", Physics::kBalance), 1);
  EXPECT_EQ(count("torques of loaded joints", Physics::kEffort), 2);
  EXPECT_EQ(count("torques of free joints", Physics::kEffort), 2);
  EXPECT_EQ(count("centre of mass", Physics::kEffort), 2);
}

TEST(Terms, TheMiddleOfThePolygonIsPreferredOnFeet) {
  const test::TemporaryFolder temporary;
  const auto dataset = Dataset::Load(test::SyntheticFolder(temporary.path() / "dataset").path());
  CollisionQuery query(dataset->collision_model());
  const auto program = MakeTaskProgram(Task::kPosture, *dataset, query, dataset->problems(Task::kPosture)[0].stances,
                                       {.physics = Physics::kBalance, .prefer_middle = true});
  program->Keep([](const Term& term) { return term.shape().kind == TermKind::kPreference; });
  ASSERT_EQ(program->terms().size(), 1u);
  const auto penalty = [&](const Eigen::VectorXd& x) {
    program->SetPoint(x);
    std::vector<double> rows;
    program->terms()[0]->Evaluate(rows);
    double sum = 0.0;
    for (const double row : rows) sum += std::max(0.0, row);
    return sum;
  };
  Eigen::VectorXd near_edge = test::StandingUpright(), at_edge = near_edge;
  near_edge[test::kBaseX] += 0.1;
  at_edge[test::kBaseX] += 0.12;
  EXPECT_LT(penalty(test::StandingUpright()), penalty(near_edge));
  EXPECT_LT(penalty(near_edge), penalty(at_edge));
  TermDerivatives(*program).CheckAt(test::Leaning(0.05));
}

}  // namespace
}  // namespace legopt
