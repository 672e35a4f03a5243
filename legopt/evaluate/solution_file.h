#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "legopt/dataset/stance.h"
#include "words/task.h"

namespace legopt {

/// The first number of a solution that cannot be read.
struct UnreadableNumber {
  int waypoint = 0;     ///< from 0
  int index = -1;       ///< within the waypoint, from 0; -1: the waypoint is neither a text nor a list
  std::string value;    ///< as the file has it, shortened
  std::string message;  ///< what is wrong with it

  /// "waypoint 3: number 7 is '1e400', which no double holds".
  std::string Describe() const;
};

/// Best point of the window of a motion at which a solver ended: no part of a solution, and written only.
struct UnsolvedPart {
  int first_waypoint = 0;                  ///< number of its first waypoint in the motion
  std::vector<Eigen::VectorXd> waypoints;  ///< n + 7 numbers each
};

/// One method's answer to one problem.
struct Solution {
  std::string method;                      ///< results are grouped by it; not empty, unique per problem
  double time_s = 0;                       ///< `timeSec`: total seconds for the problem, NaN when not available
  std::vector<Eigen::VectorXd> waypoints;  ///< `x`: n + 7 numbers each when well formed (the judge decides)
  std::optional<bool> success = {};        ///< what the writer believes; the judge decides
  std::string init_type = {};              ///< `initType`; empty when absent
  std::optional<UnreadableNumber> unreadable = {};  ///< such numbers are NaN (infinite) in `waypoints`
  std::optional<UnsolvedPart> unsolved = {};        ///< `unsolvedWindow`
};

/// A problem of a solution file. `definition.stances` is empty when the file leaves `definition` out.
struct SolvedProblem {
  ProblemDefinition definition;     ///< id and stances
  std::vector<Solution> solutions;  ///< by different methods; in the order of the file
};

/// A LegOpt solution file (docs/readings.md#problem-and-solution-files): its problems carry a `solution` array.
struct SolutionFile {
  std::string robot;                    ///< free text, may be empty
  std::string scenario;                 ///< free text, may be empty
  Task task{};                          ///< as stated, or inferred from the number of stances
  std::vector<SolvedProblem> problems;  ///< in the order of the file; each id once
  /// Names of the joints in the order of `x`, without the base; empty: the file does not say. A key of ours, "joints",
  /// that LegOpt's scripts pass over.
  std::vector<std::string> joints = {};
  /// Which builds on which machines made the solutions, for people; a key of ours, "origins", that is written and not
  /// read.
  std::vector<std::string> origins = {};
  std::string path = {};  ///< where it was read; empty when it was made
};

/// Reads a LegOpt solution file. `x` may hold newline (or space) separated strings, as LegOpt writes them, or arrays of
/// numbers; "nan" and null are read as NaN and 35 numbers as 35 numbers, for the judge to refuse. A missing `task` is
/// inferred from the number of stances.
///
/// A number that cannot be read (a word, a number beyond the doubles) spoils its solution, not the file: see
/// Solution::unreadable. NaN and Infinity, which Python writes into JSON, count as such words. What is too small for a
/// double is 0.
///
/// Throws InputError naming file, problem and method: not JSON, no `problems`, duplicate id, an empty method name, two
/// solutions of one method, `timeSec` missing, negative or no number, `joints` that are not a list of texts.
SolutionFile ReadSolutions(const std::filesystem::path& path);

/// The text of a file that ReadSolutions and LegOpt's own scripts read: numbers in their shortest round-trip form, so
/// that reading gives the same bits and judging the same verdicts.
std::string FormatSolutions(const SolutionFile& file);

/// Writes that text. A regular file, or none, is replaced in one step; symbolic links are followed and stay; anything
/// else (a device, a pipe) is written into. Throws InputError when it cannot be written; what stood there then stays,
/// and nothing is left beside it.
void WriteSolutions(const std::filesystem::path& path, const SolutionFile& file);

}  // namespace legopt
