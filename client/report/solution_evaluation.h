#pragma once

#include <string>
#include <vector>

#include "legopt/evaluate/judge.h"
#include "legopt/evaluate/solution_file.h"
#include "legopt/evaluate/summary.h"
#include "words/result.h"
#include "words/task.h"

namespace legopt {
namespace client {

/// Whose definition of a problem a solution is held to, where file and dataset both have one.
enum class Definitions {
  kFile,     ///< the file's own, as in the original evaluator
  kDataset,  ///< the dataset's
};

}  // namespace client

template <>
inline constexpr auto kWords<client::Definitions> =
    Words<client::Definitions>({{client::Definitions::kFile, "file"}, {client::Definitions::kDataset, "dataset"}});

}  // namespace legopt

namespace legopt::client {

/// One solution as judged.
struct JudgedRow {
  std::string method;
  int problem_id = 0;
  double time_s = 0;  ///< for the problem; NaN when not available
  Evaluation evaluation;
  bool claim_differs = false;     ///< the file's `success` is not the literal verdict
  bool posed = true;              ///< the dataset has a problem of this id and task
  bool other_definition = false;  ///< judged by the file's definition, which is not the dataset's
  bool unreadable = false;        ///< a number of it could not be read
};

/// What a solution file is worth on a dataset.
///
/// n of a method is the number of the dataset's problems of the task: those for which the file has no solution count as
/// not solved. Problems that the dataset does not have are counted apart.
struct EvaluationReport {
  std::string file;
  std::string dataset;
  Task task{};
  Rule rule = Rule::kSolid;
  Definitions definitions = Definitions::kFile;
  int num_posed = 0;                     ///< the dataset's problems of the task
  std::vector<int> in_file;              ///< ids of those for which the file has a solution, in file order
  std::vector<int> differing;            ///< ids of those of them whose definition in the file is not the dataset's
  std::vector<int> not_posed;            ///< ids with a solution that the dataset does not have, in file order
  bool defines = false;                  ///< the file has definitions of its own
  std::vector<JudgedRow> rows;           ///< in file order
  std::vector<MethodSummary> summaries;  ///< of the dataset's problems; none when it has none of the task
  std::vector<MethodSummary> not_posed_summaries;  ///< of the others
  std::vector<std::string> warnings;
};

/// Judges every solution of a file. A problem that has no definition in the file takes the dataset's. A solution with a
/// number that cannot be read gets the verdict kNotFinite with that as its detail. A `timeSec` of 0 counts as not
/// measured.
/// Throws InputError that names the file: `joints` that are not the robot's in its order, a problem that neither file
/// nor dataset defines, one that does not fit the task, a foot that is none of the dataset's.
EvaluationReport EvaluateSolutions(const SolutionFile& file, Judge& judge, Rule rule,
                                   Definitions definitions = Definitions::kFile);

/// Ascending ids as text: "0-3, 7".
std::string RangesOf(std::vector<int> ids);

}  // namespace legopt::client
