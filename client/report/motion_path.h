#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/problem_definition.h"
#include "legopt/judge/internal/path_examiner.h"
#include "legopt/judge/solution_file.h"
#include "legopt/types/task.h"

namespace legopt::client {

/// A solution as a path; of a motion, the arguments of MotionTimer::Compute.
struct MotionPath {
  std::vector<const Stance*> stances;  ///< per waypoint; of the problem, which must outlive this object
  TimedPath path;
  std::string fault;  ///< reason why the solution is no path, and `path` undefined; else empty
};

/// Reads the path of a solution. Waypoints of a task without time stamps are one segment apart. `size`: numbers of a
/// configuration.
MotionPath ReadMotionPath(Task task, const ProblemDefinition& problem, std::span<const Eigen::VectorXd> waypoints,
                          int size);

/// Reads the path of a solution of a file. The fault includes numbers that cannot be read.
MotionPath ReadMotionPath(Task task, const ProblemDefinition& problem, const Solution& solution, int size);

/// Returns the definition of a problem of a file: the file's, else the dataset's. Throws InputError if neither has one.
const ProblemDefinition& DefinitionOf(const SolutionFile& file, const SolvedProblem& problem, const Dataset& dataset);

}  // namespace legopt::client
