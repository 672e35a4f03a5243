#include "client/commands/motion_export.h"

#include "client/client_error.h"
#include "legopt/types/task.h"

namespace legopt::client {
namespace {

constexpr double kLowestRate_Hz = 1.0, kHighestRate_Hz = 1000.0;
constexpr int kMostSamples = 200'000;

struct ChosenMotion {
  const SolutionFile* file;
  const SolvedProblem* problem;
  const Solution* solution;

  std::string Describe() const {
    const std::string start = solution->init_type.empty() ? "" : ", " + solution->init_type;
    return std::string(ToString(file->task)) + " problem " + std::to_string(problem->definition.id) + " by " +
           solution->method + start;
  }
};

std::vector<ChosenMotion> MatchingMotions(const MotionExport& options, const std::vector<SolutionFile>& files) {
  std::vector<ChosenMotion> motions;
  for (const SolutionFile& file : files) {
    if (!DescriptionOf(file.task).windowed) continue;
    for (const SolvedProblem& problem : file.problems) {
      if (options.problem && problem.definition.id != *options.problem) continue;
      for (const Solution& solution : problem.solutions) motions.push_back({&file, &problem, &solution});
    }
  }
  return motions;
}

ChosenMotion ChooseMotion(const MotionExport& options, const std::vector<SolutionFile>& files,
                          const std::string& source) {
  const std::vector<ChosenMotion> motions = MatchingMotions(options, files);
  if (motions.size() == 1) return motions.front();
  if (motions.empty()) {
    const std::string of_problem = options.problem ? " of problem " + std::to_string(*options.problem) : "";
    throw ClientError(ExitCode::kUsage,
                      source + " has no motion" + of_problem + " that matches; check --problem, --tasks and --methods");
  }
  throw ClientError(ExitCode::kUsage, source + " has " + std::to_string(motions.size()) + " motions that match, e.g. " +
                                          motions[0].Describe() + " and " + motions[1].Describe() +
                                          "; choose one with --problem, --tasks, --methods or --initializations");
}

}  // namespace

void AddMotionExportOptions(const app::Command& command, MotionExport* options) {
  const auto motion = command.AddEnum<MotionFormat>(
      "--motion", options->format,
      "Write one motion instead of solutions, sampled in time by its shortest time law: csv, json, or contacts (phases "
      "with their contacts)");
  command.AddOption("--file", options->file, "Solution file with the motion, - for standard input, instead of results")
      .Needs(motion);
  command.AddOption("--problem", options->problem, "Problem of the motion").Check(app::WholeNumber(0)).Needs(motion);
  command.AddOption("--rate", options->rate_Hz, "Samples per second of the motion, from 1 to 1000 (default 100)")
      .Check(app::Number(kLowestRate_Hz, kHighestRate_Hz))
      .Needs(motion);
}

std::string ExportedMotion(const MotionExport& options, const std::vector<SolutionFile>& files, const Dataset& dataset,
                           const std::string& source) {
  const ChosenMotion chosen = ChooseMotion(options, files, source);
  const ProblemDefinition& problem = DefinitionOf(*chosen.file, *chosen.problem, dataset);
  const MotionPath path =
      ReadMotionPath(chosen.file->task, problem, *chosen.solution, dataset.robot().configuration_size());
  const SampledMotion motion = SampleMotion(dataset, path, options.rate_Hz, kMostSamples);
  if (const std::string reason = WhyNotSampled(motion); !reason.empty()) {
    throw ClientError(ExitCode::kJobsFailed, source + ": " + chosen.Describe() +
                                                 " cannot be sampled in time: " + reason +
                                                 "; choose another motion, or export solutions without --motion");
  }
  return FormatMotion(dataset, {.task = chosen.file->task, .problem_id = problem.id, .method = chosen.solution->method},
                      motion, *options.format);
}

}  // namespace legopt::client
