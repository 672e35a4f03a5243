// The default dataset keeps what it promises: the problems are there, and each posture problem has a solution.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "legopt/dataset/dataset.h"
#include "legopt/evaluate/judge.h"
#include "legopt/evaluate/solution_file.h"
#include "programs/data_folder.h"
#include "tests/folders.h"

namespace legopt {
namespace {

std::shared_ptr<const Dataset> DefaultDataset() {
  static const std::shared_ptr<const Dataset> dataset = Dataset::Load(SourceFolder() + "/data/garage-easier");
  return dataset;
}

TEST(GarageEasier, IsTheDefault) {
  EXPECT_TRUE(std::filesystem::equivalent(programs::DefaultDatasetFolder(), SourceFolder() + "/data/garage-easier"));
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

// Problems 0 to 24 change floors, 25 to 49 stay on one (docs/datasets.md); stances alternate double and single support.
TEST(GarageEasier, MotionsChangeFloorsOrStayOnOne) {
  for (const ProblemDefinition& problem : DefaultDataset()->problems(Task::kMotion)) {
    const auto height = [](const Stance& stance) { return stance.footholds.at(0).position.z(); };
    const double rise = std::abs(height(problem.stances.back()) - height(problem.stances.front()));
    if (problem.id < 25) {
      EXPECT_GE(rise, 1.5) << "problem " << problem.id;
    } else {
      EXPECT_LE(rise, 0.5) << "problem " << problem.id;
    }
    for (std::size_t s = 0; s < problem.stances.size(); ++s) {
      EXPECT_EQ(problem.stances[s].footholds.size(), s % 2 == 0 ? 2U : 1U)
          << "problem " << problem.id << ", stance " << s;
    }
  }
}

}  // namespace
}  // namespace legopt
