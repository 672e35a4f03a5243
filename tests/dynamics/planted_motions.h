#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/dynamics/motion_timer.h"
#include "legopt/judge/internal/path_examiner.h"
#include "legopt/judge/solution_file.h"
#include "tests/folders.h"

namespace legopt {

/// Arguments of MotionTimer::Compute.
struct PlantedMotion {
  std::vector<const Stance*> stances;  ///< per waypoint
  TimedPath path;
};

/// Fixture: the planted motions of the embedded quadruped.
class PlantedMotions : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const std::string folder = SourceFolder() + "/data/contacts-quadruped";
    dataset_ = Dataset::Load(folder);
    file_ = ReadSolutions(folder + "/solutions-motion.json");
  }
  static void TearDownTestSuite() { dataset_.reset(); }

  static PlantedMotion MotionOf(const SolvedProblem& solved) {
    PlantedMotion motion;
    const ProblemDefinition& problem = dataset_->problem(Task::kMotion, solved.definition.id);
    const int count = NumWaypoints(Task::kBalanced, static_cast<int>(problem.stances.size()));
    for (int w = 0; w < count; ++w) {
      motion.stances.push_back(&problem.stances[static_cast<size_t>(StanceOfWaypoint(Task::kBalanced, w))]);
    }
    EXPECT_FALSE(
        ParsePath(solved.solutions.front().waypoints, count, dataset_->robot().configuration_size(), &motion.path));
    return motion;
  }
  static MotionTiming Time(const PlantedMotion& motion) {
    return MotionTimer(*dataset_).Compute(motion.stances, motion.path.times, motion.path.points);
  }

  inline static std::shared_ptr<const Dataset> dataset_;
  inline static SolutionFile file_;
};

}  // namespace legopt
