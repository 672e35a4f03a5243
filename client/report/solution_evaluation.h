#pragma once

#include <string>
#include <vector>

#include "legopt/judge/judge.h"
#include "legopt/judge/solution_file.h"
#include "legopt/judge/summary.h"
#include "legopt/types/check.h"
#include "legopt/types/task.h"

namespace legopt {
namespace client {

/// Which definition of a problem to use if both file and dataset have one.
enum class Definitions {
  kFile,     ///< definitions of the file, as in the original evaluator
  kDataset,  ///< definitions of the dataset
};

}  // namespace client

template <>
inline constexpr auto kEnumNames<client::Definitions> = MakeEnumNames<client::Definitions>(
    {{client::Definitions::kFile, "file"}, {client::Definitions::kDataset, "dataset"}});

}  // namespace legopt

namespace legopt::client {

/// A judged solution.
struct JudgedRow {
  std::string method;
  int problem_id = 0;
  double time_s = 0;  ///< time for the problem; NaN if unavailable
  Evaluation evaluation;
  bool claim_differs = false;     ///< the file's `success` differs from the verdict by the original evaluator's rule
  bool posed = true;              ///< the dataset has a problem with this id and task
  bool other_definition = false;  ///< judged by the file's definition, which differs from the dataset's
  bool unreadable = false;        ///< contains an invalid number
};

/// Evaluation of a solution file on a dataset.
///
/// n of a method is the number of the dataset's problems of the task: problems without a solution in the file count as
/// not solved. Problems that the dataset does not have are counted separately.
struct EvaluationReport {
  std::string file;
  std::string dataset;
  Task task{};
  Rule rule = Rule::kSolid;
  Definitions definitions = Definitions::kFile;
  int num_posed = 0;                     ///< number of the dataset's problems of the task
  std::vector<int> in_file;              ///< ids of these problems with a solution in the file, in file order
  std::vector<int> differing;            ///< ids in `in_file` whose definition in the file differs from the dataset's
  std::vector<int> not_posed;            ///< ids with a solution that the dataset does not have, in file order
  bool defines = false;                  ///< the file contains definitions
  std::vector<JudgedRow> rows;           ///< ordered as in the file
  std::vector<MethodSummary> summaries;  ///< over the dataset's problems; empty if it has none of the task
  std::vector<MethodSummary> not_posed_summaries;  ///< over the other problems
  std::vector<std::string> warnings;
};

/// Judges every solution of a file. A problem without a definition in the file uses the dataset's. A solution with an
/// invalid number gets the verdict kNotFinite with an explanation as its detail. A `timeSec` of 0 means not measured.
/// Throws InputError with the file name: `joints` that differ from the robot's, a problem that neither file nor dataset
/// defines, one that does not fit the task, an unknown foot.
EvaluationReport EvaluateSolutions(const SolutionFile& file, Judge& judge, Rule rule,
                                   Definitions definitions = Definitions::kFile);

/// Returns ascending ids as text: "0-3, 7".
std::string RangesOf(std::vector<int> ids);

}  // namespace legopt::client
