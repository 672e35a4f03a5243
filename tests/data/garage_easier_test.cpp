// The default dataset is as documented: the problems exist, and each posture problem has a solution.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "app/data_folder.h"
#include "legopt/dataset/dataset.h"
#include "legopt/geometry/internal/exact_collision.h"
#include "legopt/judge/judge.h"
#include "legopt/judge/solution_file.h"
#include "legopt/robot/kinematics.h"
#include "tests/folders.h"

namespace legopt {
namespace {

std::shared_ptr<const Dataset> DefaultDataset() {
  static const std::shared_ptr<const Dataset> dataset = Dataset::Load(SourceFolder() + "/data/garage-easier");
  return dataset;
}

TEST(GarageEasier, IsTheDefault) {
  EXPECT_TRUE(std::filesystem::equivalent(app::DefaultDatasetFolder(), SourceFolder() + "/data/garage-easier"));
  EXPECT_EQ(DefaultDataset()->name(), "garage-easier");
}

TEST(GarageEasier, HasFiftyProblemsOfEachTask) {
  for (const Task task : {Task::kPosture, Task::kMotion}) {
    const auto& problems = DefaultDataset()->problems(task);
    ASSERT_EQ(problems.size(), 50U) << ToString(task);
    std::set<std::string> starts;
    for (std::size_t id = 0; id < problems.size(); ++id) {
      EXPECT_EQ(problems[id].id, static_cast<int>(id));
      std::string text;
      for (const Stance& stance : problems[id].stances) text += FormatStance(stance);
      EXPECT_TRUE(starts.insert(text).second) << ToString(task) << " problem " << id << " stands there twice";
    }
  }
}

TEST(GarageEasier, EveryPostureProblemHasASolutionThatTheJudgeAcceptsByBothRules) {
  const SolutionFile file = ReadSolutions(SourceFolder() + "/data/garage-easier/solutions-posture.json");
  Judge judge(DefaultDataset());
  std::set<int> solved;
  for (const SolvedProblem& problem : file.problems) {
    const auto& posed = DefaultDataset()->problems(Task::kPosture).at(static_cast<std::size_t>(problem.definition.id));
    EXPECT_EQ(FormatStance(problem.definition.stances.at(0)), FormatStance(posed.stances.at(0)));
    for (const Solution& solution : problem.solutions) {
      const Evaluation verdict = judge.Evaluate(Task::kPosture, posed, solution.waypoints);
      EXPECT_EQ(verdict.literal, Verdict::kSuccess) << "problem " << posed.id;
      EXPECT_EQ(verdict.strict, Verdict::kSuccess) << "problem " << posed.id;
      solved.insert(posed.id);
    }
  }
  EXPECT_EQ(solved.size(), 50U);
}

// Culling is shared with the solver, so no figure of the judge may depend on it. Tested as solved, with all joints
// bent, and sunk into the ground, so that there are collisions.
TEST(GarageEasier, NoFigureOfTheJudgeDependsOnCulling) {
  const SolutionFile file = ReadSolutions(SourceFolder() + "/data/garage-easier/solutions-posture.json");
  const Dataset& dataset = *DefaultDataset();
  ExactCollision culled(dataset.robot(), dataset.scene(), dataset.collision_model());
  ExactCollision exhaustive(dataset.robot(), dataset.scene(), dataset.collision_model(), Culling::kOff);
  Judge judge(DefaultDataset()), slow_judge(DefaultDataset(), Culling::kOff);
  Kinematics kinematics(dataset.robot());
  const int n = dataset.robot().num_dofs();
  int touching = 0;
  for (const SolvedProblem& problem : file.problems) {
    const auto& waypoints = problem.solutions.at(0).waypoints;
    const auto& posed = dataset.problem(Task::kPosture, problem.definition.id);
    const Evaluation a = judge.Evaluate(Task::kPosture, posed, waypoints);
    const Evaluation b = slow_judge.Evaluate(Task::kPosture, posed, waypoints);
    EXPECT_EQ(a.detail, b.detail);
    EXPECT_EQ(a.solid, b.solid);
    EXPECT_EQ(a.SolidDepth_m(), b.SolidDepth_m());
    for (const auto& [bend, sink] : {std::pair(0.0, 0.0), std::pair(0.4, 0.0), std::pair(0.0, 0.5)}) {
      Eigen::VectorXd x = waypoints.at(0);
      x.head(n).array() += bend;
      x[n + 2] -= sink;
      kinematics.Update(x);
      const auto scene_a = culled.DeepestEnvironmentContacts(kinematics);
      const auto scene_b = exhaustive.DeepestEnvironmentContacts(kinematics);
      EXPECT_EQ(scene_a.literal.depth_m, scene_b.literal.depth_m) << posed.id;
      EXPECT_EQ(scene_a.strict.depth_m, scene_b.strict.depth_m) << posed.id;
      const auto self_a = culled.SelfDepth(kinematics), self_b = exhaustive.SelfDepth(kinematics);
      EXPECT_EQ(self_a.literal_m, self_b.literal_m) << posed.id;
      EXPECT_EQ(self_a.literal_pair, self_b.literal_pair) << posed.id;
      EXPECT_EQ(self_a.strict_m, self_b.strict_m) << posed.id;
      EXPECT_EQ(culled.DeepestIgnoredContact(kinematics).depth_m, exhaustive.DeepestIgnoredContact(kinematics).depth_m);
      EXPECT_EQ(culled.DeepestContainment(kinematics).depth_m, exhaustive.DeepestContainment(kinematics).depth_m);
      touching += scene_a.strict.depth_m > 0.0 || self_a.strict_m > 0.0 ? 1 : 0;
    }
  }
  EXPECT_GT(touching, 50);
}

// Problems 0 to 24 change floors, 25 to 49 stay on one (docs/reference/datasets.md); stances alternate double and
// single support.
TEST(GarageEasier, MotionsChangeFloorsOrStayOnOne) {
  for (const ProblemDefinition& problem : DefaultDataset()->problems(Task::kMotion)) {
    const auto height = [](const Stance& stance) { return stance.contacts.at(0).position.z(); };
    const double rise = std::abs(height(problem.stances.back()) - height(problem.stances.front()));
    if (problem.id < 25) {
      EXPECT_GE(rise, 1.5) << "problem " << problem.id;
    } else {
      EXPECT_LE(rise, 0.5) << "problem " << problem.id;
    }
    for (std::size_t s = 0; s < problem.stances.size(); ++s) {
      EXPECT_EQ(problem.stances[s].contacts.size(), s % 2 == 0 ? 2U : 1U)
          << "problem " << problem.id << ", stance " << s;
    }
  }
}

}  // namespace
}  // namespace legopt
