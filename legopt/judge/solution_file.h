#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "legopt/dataset/problem_definition.h"
#include "legopt/types/task.h"

namespace legopt {

/// The first unreadable number of a solution.
struct UnreadableNumber {
  int waypoint = 0;     ///< index from 0
  int index = -1;       ///< index in the waypoint, from 0; -1: the waypoint is neither a text nor a list
  std::string value;    ///< text in the file, shortened
  std::string message;  ///< the problem

  /// Message like "waypoint 3: number 7 is '1e400', which no double holds".
  std::string Describe() const;
};

/// Best point that a solver found for the unsolved window of a motion. Not part of the solution; written but not read.
struct UnsolvedPart {
  int first_waypoint = 0;                  ///< number of its first waypoint in the motion
  std::vector<Eigen::VectorXd> waypoints;  ///< n + 7 numbers each
};

/// One method's solution of one problem.
struct Solution {
  std::string method;                               ///< name for grouping results; not empty, unique per problem
  double time_s = 0;                                ///< `timeSec`: total seconds for the problem, NaN if unknown
  std::vector<Eigen::VectorXd> waypoints;           ///< `x`: n + 7 numbers each if valid (checked by the judge)
  std::optional<bool> success = {};                 ///< the writer's claim; not used by the judge
  std::string init_type = {};                       ///< `initType`; empty if absent
  std::optional<UnreadableNumber> unreadable = {};  ///< unreadable numbers are NaN (infinite) in `waypoints`
  std::optional<UnsolvedPart> unsolved = {};        ///< `unsolvedWindow`
};

/// A problem of a solution file. `definition.stances` is empty if the file omits `definition`.
struct SolvedProblem {
  ProblemDefinition definition;     ///< id and stances
  std::vector<Solution> solutions;  ///< one per method; ordered as in the file
};

/// A LegOpt solution file (docs/explanation/paper.md#problem-and-solution-files): problems with a `solution` array.
struct SolutionFile {
  std::string robot;                    ///< free text, may be empty
  std::string scenario;                 ///< free text, may be empty
  Task task{};                          ///< task of the file, or inferred from the number of stances
  std::vector<SolvedProblem> problems;  ///< ordered as in the file; unique ids
  /// Joint names in the order of `x`, without the base; empty if the file has none. The key "joints" is an extension
  /// that LegOpt's scripts ignore.
  std::vector<std::string> joints = {};
  /// Builds and machines that produced the solutions, for information. The key "origins" is an extension that is
  /// written but not read.
  std::vector<std::string> origins = {};
  std::string path = {};  ///< path it was read from; empty for a new file
};

/// Reads a LegOpt solution file. `x` may hold strings with numbers separated by newlines or spaces, as LegOpt writes
/// them, or arrays of numbers. "nan" and null are read as NaN, and waypoints of any length are accepted, for the judge
/// to reject. A missing `task` is inferred from the number of stances.
///
/// An unreadable number (a word, a number beyond the range of double) invalidates its solution, not the file: see
/// Solution::unreadable. NaN and Infinity, which Python writes into JSON, count as such words. Numbers too small for a
/// double are 0.
///
/// Throws InputError with file, problem and method: not JSON, no `problems`, duplicate id, empty method name, two
/// solutions of one method, `timeSec` missing, negative or not a number, `joints` that is not a list of texts.
SolutionFile ReadSolutions(const std::filesystem::path& path);

/// Formats a solution file for ReadSolutions and LegOpt's own scripts. Numbers have their shortest round-trip form, so
/// that reading returns the same bits and judging the same verdicts.
std::string FormatSolutions(const SolutionFile& file);

/// Writes a solution file. A regular file is replaced atomically; symbolic links are followed and kept; other files (a
/// device, a pipe) are written to. Throws InputError on failure; the previous content then remains, without temporary
/// files.
void WriteSolutions(const std::filesystem::path& path, const SolutionFile& file);

}  // namespace legopt
