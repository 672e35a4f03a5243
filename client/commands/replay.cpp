#include "client/replay/replay.h"

#include <algorithm>
#include <iostream>
#include <memory>

#include "app/build_identity.h"
#include "app/command_line.h"
#include "app/folder_cache.h"
#include "app/host_resources.h"
#include "app/printable.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/report/escaped_text.h"
#include "client/report/result_dataset.h"
#include "client/report/result_filter.h"
#include "client/suite/input_files.h"
#include "legopt/types/input_error.h"
#include "worker/external/external_solvers.h"

namespace legopt::client {
namespace {

struct ReplayOptions {
  std::optional<std::int64_t> job;
  std::optional<int> random;
  std::uint64_t seed = 1;
  std::optional<std::int64_t> experiment;
  ResultFilter filter;
  std::optional<std::string> dataset;
  std::vector<std::filesystem::path> solvers;  ///< description files of external solvers
  bool any_build = false;
  int parallel = 0;
  bool json = false;
  SourceOptions source;
  app::BuildFacts build;
};

std::vector<StoredJob> ChosenJobs(const ReplayOptions& options, const SolverRegistry& registry) {
  const auto source = OpenResults(options.source);
  std::vector<std::int64_t> ids;
  if (options.job) {
    ids = {*options.job};
  } else {
    const auto experiment = FindExperiment(*source, options.experiment);
    const KeptCells kept(*source, experiment.id, options.filter);
    ids = DrawJobs(*source, experiment.id, kept.ids(), options.random.value_or(1), options.seed);
    if (ids.empty()) {
      throw ClientError(ExitCode::kUsage,
                        "experiment " + std::to_string(experiment.id) + " has no result that can be replayed" +
                            (options.filter.empty() ? "" : " among those of " + Describe(options.filter)));
    }
  }
  std::vector<StoredJob> jobs;
  for (const std::int64_t id : ids) jobs.push_back(ReadStoredJob(*source, id, registry));
  return jobs;
}

// Throws if a job has a result of another build, because its bits may differ.
void RequireSameBuild(const std::vector<StoredJob>& jobs, const ReplayOptions& options) {
  const std::string mine = app::BuildId(options.build);
  const auto other = std::find_if(jobs.begin(), jobs.end(), [&](const StoredJob& job) { return job.build_id != mine; });
  if (other == jobs.end()) return;
  const std::string text = "job " + std::to_string(other->job_id) + " was solved by " +
                           (other->build_id.empty() ? "a build that is not known" : "build " + other->build_id) +
                           ", and this is build " + mine;
  if (!options.any_build) {
    throw ClientError(ExitCode::kUsage, text + "; replay it with that build, or give --any-build to compare the two");
  }
  std::cerr << "legopt: warning: " << text << ": bits may differ\n";
}

std::shared_ptr<const Dataset> LoadStoredDataset(ResultSource& source, const StoredJob& job,
                                                 const ReplayOptions& options) {
  if (!options.dataset) {
    if (auto found = FindResultDataset(source, job.dataset_hash)) return found;
  }
  const auto folder = ChooseDatasetFolder(options.dataset, nullptr);
  auto dataset = Dataset::Load(folder, GuardedReader());
  if (dataset->content_hash() == job.dataset_hash) return dataset;
  throw ClientError(ExitCode::kDatasetMismatch, "job " + std::to_string(job.job_id) + " was solved on the dataset '" +
                                                    job.dataset_name + "' of hash " + job.dataset_hash + ", but " +
                                                    folder.string() + " has hash " + dataset->content_hash() +
                                                    "; name the right folder with --dataset");
}

std::string DescribeReplay(const StoredJob& job, const Replay& replay) {
  std::string text = "job " + std::to_string(replay.job_id) + " (" + Described(job) +
                     "): " + std::string(ToString(replay.outcome)) + "\n";
  for (const std::string& difference : replay.differences) text += "  " + difference + "\n";
  if (!replay.divergence.empty()) text += "  the histories part " + replay.divergence + "\n";
  return app::PrintableLines(text);
}

nlohmann::ordered_json ReplayJson(const StoredJob& job, const Replay& replay) {
  return {{"job", replay.job_id},           {"experiment_id", job.experiment_id},  {"described", Described(job)},
          {"build_id", job.build_id},       {"outcome", ToString(replay.outcome)}, {"differences", replay.differences},
          {"divergence", replay.divergence}};
}

void PrintReplays(const std::vector<StoredJob>& jobs, const std::vector<Replay>& replays, bool json) {
  EnumArray<Reproduction, std::size_t> counts;
  auto list = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    ++counts[replays[i].outcome];
    list.push_back(ReplayJson(jobs[i], replays[i]));
    const bool told = jobs.size() == 1 || replays[i].outcome != Reproduction::kBitIdentical;
    if (told && !json) std::cout << DescribeReplay(jobs[i], replays[i]);
  }
  const std::size_t identical = counts[Reproduction::kBitIdentical];
  if (json) {
    std::cout << JsonText(nlohmann::ordered_json{{"replayed", jobs.size()},
                                                 {"bit_identical", identical},
                                                 {"same_status", counts[Reproduction::kSameStatus]},
                                                 {"differ", counts[Reproduction::kDiffers]},
                                                 {"jobs", list}})
              << "\n";
    return;
  }
  if (jobs.size() == 1) return;
  std::cout << identical << " of " << jobs.size() << " bit-identical";
  if (identical < jobs.size()) {
    std::cout << ", " << counts[Reproduction::kSameStatus] << " with the same status, "
              << counts[Reproduction::kDiffers] << " differ";
  }
  std::cout << "\n";
}

ExitCode ExitCodeOf(const std::vector<Replay>& replays) {
  Reproduction worst = Reproduction::kBitIdentical;
  for (const Replay& replay : replays) worst = std::max(worst, replay.outcome);
  constexpr EnumArray<Reproduction, ExitCode> kCodes = {
      {{ExitCode::kOk, ExitCode::kOtherBits, ExitCode::kOtherResult}}};
  return kCodes[worst];
}

std::vector<external::Declaration> ReadCopied(const std::vector<std::filesystem::path>& files,
                                              const std::vector<std::unique_ptr<RereadableFile>>& copies) {
  try {
    return external::ReadDeclarations(files);
  } catch (const InputError& error) {
    throw WithGivenNames(error, copies);
  }
}

ExitCode ReplayStored(const ReplayOptions& options) {
  if (options.job.has_value() == options.random.has_value()) {
    throw ClientError(ExitCode::kUsage, "name a job, or let --random N draw some: 'legopt replay 12'");
  }
  if (options.job && !options.filter.empty()) {
    throw ClientError(ExitCode::kUsage, Describe(options.filter) + ": selects random jobs; give --random N, no job");
  }
  // Each job is solved in a separate process, which starts external solvers itself.
  std::vector<std::filesystem::path> solvers = options.solvers;
  const auto solver_copies = MakeRereadable(solvers);
  const SolverRegistry registry = external::RegistryForForks(ReadCopied(solvers, solver_copies));
  const std::vector<StoredJob> jobs = ChosenJobs(options, registry);
  RequireSameBuild(jobs, options);
  JobRunner runner(LoadStoredDataset(*OpenResults(options.source), jobs.front(), options), registry);
  std::size_t done = 0;
  const auto tell = [&](const Replay& replay) {
    ++done;
    if (jobs.size() == 1 || replay.outcome == Reproduction::kBitIdentical) return;
    std::cerr << "legopt: job " << replay.job_id << ": " << ToString(replay.outcome) << " (" << done << " of "
              << jobs.size() << " done)\n";
  };
  const std::vector<Replay> replays = ReplayJobs(runner, jobs, options.parallel, tell);
  PrintReplays(jobs, replays, options.json);
  return ExitCodeOf(replays);
}

}  // namespace

void AddReplayCommand(const app::Command& program, Invocation* invocation) {
  constexpr int kMaxJobs = 1'000'000, kMaxParallel = 256;
  const auto command = program.AddCommand("replay", "Solve a stored job again on this machine and compare the bits");
  const auto options = std::make_shared<ReplayOptions>();
  command.AddOption("JOB", options->job, "Job, as 'legopt list' shows it").Check(app::WholeNumber(1));
  command
      .AddOption("--random", options->random,
                 "Replay this many random jobs of an experiment, evenly over methods and tasks")
      .Check(app::WholeNumber(1, kMaxJobs));
  command.AddOption("--seed", options->seed, "Seed of --random (default 1)").Check(app::WholeNumber(0));
  command.AddOption("--experiment", options->experiment, "Experiment for --random (default: the newest)")
      .Check(app::WholeNumber(1));
  AddResultFilterOptions(command, &options->filter);
  command.AddOption("--jobs", options->parallel, "Number of parallel jobs (default: the processors granted)")
      .Check(app::WholeNumber(1, kMaxParallel));
  AddDatasetOption(command, &options->dataset);
  command.AddOption("--solver", options->solvers,
                    "Description file of an external solver whose jobs are replayed; may be repeated "
                    "(docs/reference/external-solvers.md)");
  command.AddFlag("--any-build", options->any_build, "Replay even if another build solved the job");
  AddTextOrJsonOption(command, &options->json);
  AddSourceOptions(command, &options->source);
  command.WhenChosen([=] {
    options->build = invocation->build;
    if (options->parallel == 0) {
      options->parallel = app::GrantedProcessors(app::ReadProcessorFacts()).processors;
    }
    invocation->body = [options] { return ReplayStored(*options); };
  });
}

}  // namespace legopt::client
