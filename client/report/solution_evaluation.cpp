#include "client/report/solution_evaluation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "legopt/dataset/problem_definition.h"
#include "legopt/robot/robot_model.h"
#include "legopt/types/input_error.h"

namespace legopt::client {
namespace {

// Tolerance for files written with fewer digits; the judge's tolerances are a million times larger.
constexpr double kSameDefinition = 1e-9;

bool Same(const ContactTarget& a, const ContactTarget& b) {
  const auto largest = [](const auto& difference) { return difference.cwiseAbs().maxCoeff(); };
  return a.contact == b.contact && largest(a.position - b.position) <= kSameDefinition &&
         std::min(largest(a.rotation.coeffs() - b.rotation.coeffs()),
                  largest(a.rotation.coeffs() + b.rotation.coeffs())) <= kSameDefinition;
}

bool Same(const ProblemDefinition& a, const ProblemDefinition& b) {
  const auto same_stance = [](const Stance& s, const Stance& t) {
    return std::equal(s.contacts.begin(), s.contacts.end(), t.contacts.begin(), t.contacts.end(),
                      [](const ContactTarget& f, const ContactTarget& g) { return Same(f, g); });
  };
  return std::equal(a.stances.begin(), a.stances.end(), b.stances.begin(), b.stances.end(), same_stance);
}

const ProblemDefinition* Find(const std::vector<ProblemDefinition>& problems, int id) {
  const auto found = std::find_if(problems.begin(), problems.end(), [id](const auto& p) { return p.id == id; });
  return found == problems.end() ? nullptr : &*found;
}

// Throws if the file lists joints that differ from the robot's, or in another order.
void CheckJoints(const SolutionFile& file, const RobotModel& robot) {
  if (file.joints.empty()) return;
  const auto fail = [&](const std::string& field, const std::string& value, const std::string& message) {
    throw InputError({.file = file.path,
                      .field = field,
                      .value = value,
                      .message = message,
                      .fix = "write 'x' and 'joints' in the order of 'legopt dataset info'"});
  };
  if (static_cast<int>(file.joints.size()) != robot.num_dofs()) {
    fail("joints", std::to_string(file.joints.size()) + " names",
         "the robot '" + robot.name() + "' has " + std::to_string(robot.num_dofs()) + " joints");
  }
  const std::vector<std::string> expected = DofNames(robot);
  for (std::size_t dof = 0; dof < expected.size(); ++dof) {
    const std::string& name = file.joints[dof];
    if (name == expected[dof]) continue;
    fail("joints[" + std::to_string(dof) + "]", name,
         "joint " + std::to_string(dof) + " of the robot is '" + expected[dof] + "'");
  }
}

// Returns the dataset's names of its robot and its scenario, from its problem file.
ProblemFile LabelsOf(const Dataset& dataset, Task task) {
  const DatasetDescription description = DescribeDataset(dataset.folder());
  const std::string& name = description.problem_files[task];
  return name.empty() ? ProblemFile() : ReadProblemFile(dataset.folder() / name);
}

void WarnOfLabels(const SolutionFile& file, const Dataset& dataset, std::vector<std::string>* warnings) {
  const ProblemFile labels = LabelsOf(dataset, file.task);
  const auto check = [&](const char* key, const std::string& value, const std::string& known,
                         const std::string& label) {
    if (value.empty() || value == known || value == label) return;
    warnings->push_back(file.path + ": " + key + ": the file names '" + value + "', the dataset '" + known +
                        "'; is it the right --dataset?");
  };
  check("robot", file.robot, dataset.robot().name(), labels.robot);
  check("scenario", file.scenario, dataset.name(), labels.scenario);
}

// Evaluates a file on a dataset.
class Evaluator {
 public:
  Evaluator(const SolutionFile& file, Judge& judge, Rule rule, Definitions definitions) : file_(file), judge_(judge) {
    report_.file = file.path;
    report_.dataset = dataset().name();
    report_.task = file.task;
    report_.rule = rule;
    report_.definitions = definitions;
    report_.num_posed = static_cast<int>(dataset().problems(file.task).size());
  }

  EvaluationReport Run() {
    CheckJoints(file_, dataset().robot());
    WarnOfLabels(file_, dataset(), &report_.warnings);
    for (const SolvedProblem& problem : file_.problems) {
      if (!problem.solutions.empty()) JudgeProblem(problem);
    }
    WarnOfDefinitions();
    WarnOfTimes();
    Summarize();
    return std::move(report_);
  }

 private:
  const Dataset& dataset() const { return judge_.dataset(); }

  void JudgeProblem(const SolvedProblem& problem) {
    const int id = problem.definition.id;
    const bool defined = !problem.definition.stances.empty();
    const ProblemDefinition* posed = Find(dataset().problems(file_.task), id);
    if (posed == nullptr && !defined) {
      throw InputError({.file = file_.path,
                        .field = "problem " + std::to_string(id),
                        .value = "",
                        .message = "has no 'definition', and the dataset '" + dataset().name() + "' has no " +
                                   std::string(ToString(file_.task)) + " problem of this id",
                        .fix = "add the definition, correct the id, or name the right --dataset"});
    }
    const bool differs = posed != nullptr && defined && !Same(*posed, problem.definition);
    const bool by_file = defined && (posed == nullptr || report_.definitions == Definitions::kFile);
    (posed == nullptr ? report_.not_posed : report_.in_file).push_back(id);
    if (differs) report_.differing.push_back(id);
    report_.defines = report_.defines || defined;
    for (const Solution& solution : problem.solutions) {
      JudgeSolution(solution, by_file ? problem.definition : *posed);
      report_.rows.back().posed = posed != nullptr;
      report_.rows.back().other_definition = differs && by_file;
    }
  }

  void JudgeSolution(const Solution& solution, const ProblemDefinition& definition) {
    JudgedRow row{solution.method, definition.id, solution.time_s, Evaluate(solution, definition)};
    if (solution.unreadable) Spoil(*solution.unreadable, &row);
    if (row.time_s == 0) {
      row.time_s = std::numeric_limits<double>::quiet_NaN();
      ++untimed_;
    }
    row.claim_differs = solution.success && *solution.success != (row.evaluation.literal == Verdict::kSuccess);
    if (row.claim_differs && !row.unreadable) {
      report_.warnings.push_back("problem " + std::to_string(definition.id) + ", " + solution.method +
                                 ": the file says " + (*solution.success ? "success" : "no success") +
                                 ", the judge says " + std::string(ToString(row.evaluation.literal)));
    }
    report_.rows.push_back(std::move(row));
  }

  // Adds the file name to errors of the judge.
  Evaluation Evaluate(const Solution& solution, const ProblemDefinition& definition) {
    try {
      return judge_.Evaluate(file_.task, definition, solution.waypoints);
    } catch (const InputError& error) {
      InputError::Fault fault = error.fault();
      if (fault.file.empty()) fault.file = file_.path;
      throw InputError(std::move(fault));
    }
  }

  void Spoil(const UnreadableNumber& number, JudgedRow* row) {
    row->unreadable = true;
    row->evaluation.literal = row->evaluation.strict = Verdict::kNotFinite;
    row->evaluation.failed_waypoint = number.waypoint;
    row->evaluation.detail = number.Describe();
    row->evaluation.cost = Evaluation::kNotEvaluated;
    report_.warnings.push_back(file_.path + ": problem " + std::to_string(row->problem_id) + ", " + row->method + ", " +
                               number.Describe() + "; this solution counts as failed");
  }

  void WarnOfDefinitions() {
    if (report_.differing.empty()) return;
    const std::size_t count = report_.differing.size();
    const std::string used = report_.definitions == Definitions::kFile ? "the file's own" : "the dataset's";
    report_.warnings.push_back(
        (count == 1 ? "problem " + RangesOf(report_.differing) + ": its definition differs from the dataset's; "
                    : "problems " + RangesOf(report_.differing) + ": their definitions differ from the dataset's; ") +
        used + (count == 1 ? " is used" : " are used"));
  }

  void WarnOfTimes() {
    if (untimed_ == 0) return;
    report_.warnings.push_back(std::to_string(untimed_) + (untimed_ == 1 ? " solution has" : " solutions have") +
                               " timeSec 0, which counts as not measured");
  }

  void Summarize() {
    std::vector<JudgedSolution> posed, others;
    for (const JudgedRow& row : report_.rows) {
      (row.posed ? posed : others)
          .push_back({row.method, row.problem_id, row.time_s, row.evaluation, row.other_definition});
    }
    std::vector<int> ids;
    for (const auto& problem : dataset().problems(file_.task)) ids.push_back(problem.id);
    report_.summaries = legopt::Summarize(posed, report_.rule, ids);
    report_.not_posed_summaries = legopt::Summarize(others, report_.rule);
    if (!ids.empty()) AddAbsentMethods(ids);
  }

  // Adds methods that solve only problems that the dataset does not have.
  void AddAbsentMethods(const std::vector<int>& ids) {
    constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
    for (const MethodSummary& other : report_.not_posed_summaries) {
      const bool present = std::any_of(report_.summaries.begin(), report_.summaries.end(),
                                       [&](const MethodSummary& row) { return row.method == other.method; });
      if (present) continue;
      report_.summaries.push_back({.method = other.method,
                                   .num_problems = static_cast<int>(ids.size()),
                                   .mean_cost = kNothing,
                                   .mean_time_s = kNothing,
                                   .missing = ids});
    }
  }

  const SolutionFile& file_;
  Judge& judge_;
  EvaluationReport report_;
  int untimed_ = 0;
};

}  // namespace

EvaluationReport EvaluateSolutions(const SolutionFile& file, Judge& judge, Rule rule, Definitions definitions) {
  return Evaluator(file, judge, rule, definitions).Run();
}

std::string RangesOf(std::vector<int> ids) {
  std::sort(ids.begin(), ids.end());
  std::string text;
  for (std::size_t first = 0; first < ids.size();) {
    std::size_t last = first;
    while (last + 1 < ids.size() && ids[last + 1] <= ids[last] + 1) ++last;
    text += (text.empty() ? "" : ", ") + std::to_string(ids[first]);
    if (last > first) text += (last == first + 1 ? ", " : "-") + std::to_string(ids[last]);
    first = last + 1;
  }
  return text;
}

}  // namespace legopt::client
