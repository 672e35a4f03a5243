#include "client/commands/contact_sequences.h"

#include <algorithm>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/command_line.h"
#include "app/folder_cache.h"
#include "app/printable.h"
#include "client/client_error.h"
#include "client/commands/options.h"
#include "client/report/motion_path.h"
#include "client/suite/input_files.h"
#include "legopt/dataset/dataset.h"
#include "legopt/dataset/internal/dataset_writer.h"
#include "legopt/files/written_file.h"
#include "legopt/import/contact_sequence.h"
#include "legopt/judge/solution_file.h"
#include "legopt/types/input_error.h"

namespace legopt::client {
namespace {

struct SequenceImport {
  std::vector<std::string> files;
  std::string out;
  std::optional<std::string> dataset;
  std::vector<std::string> effectors;
};

/// Parses EFFECTOR=CONTACT, once per effector.
std::map<std::string, std::string> ParseEffectors(const std::vector<std::string>& words) {
  std::map<std::string, std::string> effectors;
  for (const std::string& word : words) {
    const std::size_t equals = word.rfind('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == word.size()) {
      throw InputError({.file = "",
                        .field = "--effectors",
                        .value = word,
                        .message = "is not EFFECTOR=CONTACT",
                        .fix = "e.g. --effectors leg_left_sole_fix_joint=l_foot"});
    }
    if (!effectors.emplace(word.substr(0, equals), word.substr(equals + 1)).second) {
      throw InputError({.file = "",
                        .field = "--effectors",
                        .value = word,
                        .message = "the effector is named twice",
                        .fix = "keep one contact for it"});
    }
  }
  return effectors;
}

std::string PhasesOf(std::size_t count) { return std::to_string(count) + (count == 1 ? " phase" : " phases"); }

/// Throws ClientError if the sequences are problems of different tasks.
void RequireOneTask(const std::vector<ProblemDefinition>& problems, const std::vector<std::string>& files) {
  const auto is_posture = [](const ProblemDefinition& problem) { return problem.stances.size() == 1; };
  const auto other = std::ranges::find_if(
      problems, [&](const ProblemDefinition& problem) { return is_posture(problem) != is_posture(problems.front()); });
  if (other == problems.end()) return;
  const std::size_t index = static_cast<std::size_t>(other - problems.begin());
  throw ClientError(ExitCode::kUsage,
                    files[index] + " has " + PhasesOf(other->stances.size()) + ", but " + files.front() + " has " +
                        PhasesOf(problems.front().stances.size()) +
                        "; a posture has one phase, a motion two or more: import them into two files");
}

ExitCode ImportSequences(const SequenceImport& options) {
  const std::map<std::string, std::string> effectors = ParseEffectors(options.effectors);
  const auto dataset = Dataset::Load(ChooseDatasetFolder(options.dataset, nullptr), GuardedReader());
  std::vector<ProblemDefinition> problems;
  for (const std::string& file : options.files) {
    ImportedSequence imported = StancesOf(ReadContactSequence(InputFile(file)), *dataset, effectors, file);
    for (const std::string& warning : imported.warnings) {
      std::cerr << "legopt: warning: " << app::Printable(file + ": " + warning) << "\n";
    }
    problems.push_back({.id = static_cast<int>(problems.size()), .stances = std::move(imported.stances)});
  }
  RequireOneTask(problems, options.files);
  const Task task = problems.front().stances.size() == 1 ? Task::kPosture : Task::kMotion;
  WriteOutputFile(options.out, FormatProblems(problems, task, dataset->robot().name(), dataset->name()));
  for (std::size_t i = 0; i < problems.size(); ++i) {
    std::cerr << ToString(task) << " problem " << i << ": " << PhasesOf(problems[i].stances.size()) << " of "
              << app::Printable(options.files[i]) << "\n";
  }
  return ExitCode::kOk;
}

struct SequenceExport {
  std::optional<std::string> dataset;
  Task task = Task::kMotion;
  int problem = 0;
  std::optional<std::string> solutions;
  std::optional<std::string> method;
  std::string out;
};

/// Returns the chosen solution of a problem in a solution file.
const Solution& SolutionOf(const SolvedProblem& problem, const SequenceExport& options) {
  std::string methods;
  const Solution* chosen = nullptr;
  for (const Solution& solution : problem.solutions) {
    methods += (methods.empty() ? "" : ", ") + solution.method;
    if (!options.method || solution.method == *options.method) chosen = chosen == nullptr ? &solution : chosen;
  }
  const std::string place = *options.solutions + ": problem " + std::to_string(options.problem);
  if (chosen == nullptr) {
    throw ClientError(
        ExitCode::kUsage,
        place + (methods.empty() ? " has no solution" : " has no solution of this method; it has " + methods));
  }
  if (!options.method && problem.solutions.size() > 1) {
    throw ClientError(ExitCode::kUsage, place + " has several solutions; choose one with --method: " + methods);
  }
  return *chosen;
}

/// Returns the waypoints of a solution, after checking that they fit robot, task and stances.
std::vector<Eigen::VectorXd> WaypointsOf(const Dataset& dataset, const std::vector<Stance>& stances,
                                         const SequenceExport& options) {
  const SolutionFile file = ReadSolutions(InputFile(*options.solutions));
  if (DescriptionOf(file.task).problems != DescriptionOf(options.task).problems) {
    throw ClientError(ExitCode::kUsage,
                      *options.solutions + ": the solutions are " + std::string(DescriptionOf(file.task).plural) +
                          ", but the problem is one of " + std::string(DescriptionOf(options.task).plural) +
                          "; choose another file, or --task");
  }
  const auto problem =
      std::ranges::find(file.problems, options.problem, [](const SolvedProblem& of) { return of.definition.id; });
  if (problem == file.problems.end()) {
    throw ClientError(ExitCode::kUsage,
                      *options.solutions + ": there is no problem " + std::to_string(options.problem));
  }
  const Solution& solution = SolutionOf(*problem, options);
  const int size = dataset.robot().configuration_size();
  const ProblemDefinition definition{.id = options.problem, .stances = stances};
  const MotionPath solved = ReadMotionPath(file.task, definition, solution, size);
  std::string fault = solved.fault;
  std::vector<Eigen::VectorXd> waypoints;
  for (const std::size_t point : solved.path.waypoints) {
    waypoints.push_back(solved.path.points[point]);
    const bool fits = waypoints.back().size() == size && waypoints.back().allFinite();
    if (!fits && fault.empty()) fault = "a waypoint is not " + std::to_string(size) + " finite numbers";
  }
  if (fault.empty()) return waypoints;
  throw ClientError(ExitCode::kUsage, *options.solutions + ": problem " + std::to_string(options.problem) + ", '" +
                                          solution.method + "': " + fault);
}

ExitCode ExportSequence(const SequenceExport& options) {
  const auto dataset = Dataset::Load(ChooseDatasetFolder(options.dataset, nullptr), GuardedReader());
  const std::vector<Stance>& stances = dataset->problem(options.task, options.problem).stances;
  std::vector<Eigen::VectorXd> waypoints;
  if (options.solutions) waypoints = WaypointsOf(*dataset, stances, options);
  const std::string text = FormatContactSequence(SequenceOf(*dataset, stances, waypoints));
  if (options.out == "-") {
    std::cout << text << std::flush;
  } else {
    WriteOutputFile(options.out, text);
  }
  const auto touching = std::ranges::any_of(
      stances, [](const Stance& stance) { return !std::ranges::all_of(stance.contacts, &ContactTarget::carries); });
  if (touching) {
    std::cerr << "legopt: warning: contacts that only touch are no part of a phase; only legopt reads them\n";
  }
  return ExitCode::kOk;
}

void AddImport(const app::Command& dataset, Invocation* invocation) {
  const auto command = dataset.AddCommand(
      "import-sequence", "Convert contact sequences of multicontact-api (XML archives) to a problem file");
  const auto options = std::make_shared<SequenceImport>();
  command.AddOption("FILE", options->files, "XML archives; each becomes a problem, each phase a stance").Required();
  command.AddOption("--out", options->out, "Problem file to write (JSON)").Required();
  AddDatasetOption(command, &options->dataset);
  command.AddList("--effectors", options->effectors,
                  "Contacts of effectors, EFFECTOR=CONTACT, comma separated (default: the contact, or the only contact "
                  "on the link or behind the joint, with the effector's name)");
  command.WhenChosen([=] { invocation->body = [options] { return ImportSequences(*options); }; });
}

void AddExport(const app::Command& dataset, Invocation* invocation) {
  const auto command = dataset.AddCommand(
      "export-sequence", "Write the stances of a problem as a contact sequence of multicontact-api (XML archive)");
  const auto options = std::make_shared<SequenceExport>();
  command.AddOption("PROBLEM", options->problem, "Id of the problem").Required();
  command.AddOption("--out", options->out, "File to write, - for standard output").Required();
  AddDatasetOption(command, &options->dataset);
  command.AddEnum<Task>("--task", options->task, "Task of the problem (default: motion)");
  command.AddOption("--solutions", options->solutions,
                    "LegOpt solution JSON: its configurations become q_init and q_final of the phases");
  command.AddOption("--method", options->method, "Method of the solution, if the file has several");
  command.WhenChosen([=] { invocation->body = [options] { return ExportSequence(*options); }; });
}

}  // namespace

void AddSequenceCommands(const app::Command& dataset, Invocation* invocation) {
  AddImport(dataset, invocation);
  AddExport(dataset, invocation);
}

}  // namespace legopt::client
