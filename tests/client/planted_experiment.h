#pragma once

#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/judge/solution_file.h"
#include "test_database.h"
#include "tests/folders.h"

namespace legopt::client {

/// Folder of the embedded quadruped with planted motions.
inline std::string PlantedFolder() { return SourceFolder() + "/data/contacts-quadruped"; }

/// Its planted motions of the given problems.
inline SolutionFile PlantedMotionsOf(const std::vector<int>& problems) {
  SolutionFile file = ReadSolutions(PlantedFolder() + "/solutions-motion.json");
  std::erase_if(file.problems, [&](const SolvedProblem& problem) {
    return std::ranges::find(problems, problem.definition.id) == problems.end();
  });
  return file;
}

/// An experiment whose results are planted motions: job k + 1 has the k-th one.
inline TestExperiment PlantedExperiment(const Dataset& dataset, const SolutionFile& file) {
  TestExperiment experiment;
  experiment.dataset_name = dataset.name();
  experiment.dataset_hash = dataset.content_hash();
  experiment.task = "balanced";
  for (const SolvedProblem& problem : file.problems) {
    const std::vector<Eigen::VectorXd>& waypoints = problem.solutions.front().waypoints;
    experiment.num_waypoints = static_cast<int>(waypoints.size());
    experiment.results.push_back({.problem = problem.definition.id, .waypoints = waypoints});
  }
  return experiment;
}

}  // namespace legopt::client
