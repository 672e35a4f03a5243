#include <iostream>
#include <map>
#include <memory>
#include <utility>

#include "app/command_line.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/report/benchmark_table.h"
#include "client/report/result_filter.h"
#include "client/service/experiment_status.h"
#include "db/named_queries.h"
#include "legopt/input/json.h"
#include "legopt/types/check.h"
#include "legopt/types/job.h"
#include "legopt/types/nearest_name.h"
#include "legopt/types/task.h"

namespace legopt::client {
namespace {

constexpr int kDefaultLimit = 1000;

struct ListOptions {
  std::optional<std::int64_t> experiment;
  std::optional<JobState> state;
  std::optional<Verdict> verdict;
  ResultFilter filter;
  std::optional<int> problem;
  bool unsolved = false;
  std::optional<Rule> rule;
  int limit = kDefaultLimit;
  SourceOptions source;
  ListingOptions listing;
};

std::string FaultOfVerdict(const std::string& word) {
  if (ParseEnum<Verdict>(word)) return {};
  return "'" + word + "' is no verdict; " + SuggestName(word, app::EnumNamesOf<Verdict>());
}

// Throws if the experiment does not have the problem; otherwise the empty list would look like a problem without jobs.
void RequireProblem(ResultSource& source, std::int64_t experiment_id, int problem) {
  const Listing found =
      source.Query(db::Sql(db::Query::kProblemRanges, {{"experiment_id", experiment_id}, {"problem_id", problem}}));
  EnumArray<Task, std::string> known;
  for (std::size_t i = 0; i < found.rows.size(); ++i) {
    if (found.At(i, "n").get<int>() > 0) return;
    const Task task = found.EnumAt<Task>(i, "task");
    known[task] = std::string(ToString(task)) + " " + Dump(found.At(i, "first")) + " to " + Dump(found.At(i, "last"));
  }
  std::string text;
  for (const std::string& range : known) {
    if (!range.empty()) text += (text.empty() ? "; it has " : ", ") + range;
  }
  throw ClientError(ExitCode::kUsage, "--problem " + std::to_string(problem) + ": experiment " +
                                          std::to_string(experiment_id) + " has no such problem" + text);
}

std::string Sql(const ListOptions& options, const ExperimentInfo& experiment, ResultSource& source) {
  const std::vector<std::string> columns = DistinguishingColumns(source, experiment.id);
  const KeptCells kept(source, experiment.id, options.filter);
  if (!options.problem) source.AnnounceJobs(kept.num_jobs().value_or(experiment.num_jobs), experiment.id);
  const auto shown = [&](const char* column) { return std::ranges::find(columns, column) != columns.end(); };
  return db::Sql(db::Query::kJobListing, {{"experiment_id", experiment.id},
                                          {"rule", options.rule.value_or(experiment.rule)},
                                          {"show_multi_starts", shown("multi_starts")},
                                          {"show_sample_size", shown("sample_size")},
                                          {"show_incremental", shown("incremental")},
                                          {"show_collision", shown("collision")},
                                          {"state", options.state},
                                          {"verdict", options.verdict},
                                          {"cell_ids", kept.ids()},
                                          {"problem_id", options.problem},
                                          {"unsolved", options.unsolved}});
}

// Adds the progress of leased jobs, which only the server knows. Without any, the listing equals that of the server's
// file.
void AddProgress(const ListOptions& options, std::int64_t experiment_id, Listing* jobs) {
  ServerConnection server(options.source.network);
  std::map<std::int64_t, std::string> progress;
  for (const auto& experiment : ParseExperiments(server.Status(experiment_id))) {
    for (const auto& job : experiment.running) {
      progress[job.job] = std::to_string(job.done) + "/" + std::to_string(job.total);
    }
  }
  if (progress.empty()) return;
  jobs->columns.emplace_back("progress");
  for (std::size_t i = 0; i < jobs->rows.size(); ++i) {
    const auto found = progress.find(jobs->At(i, "job").get<std::int64_t>());
    jobs->rows[i].push_back(found == progress.end() ? nlohmann::json() : nlohmann::json(found->second));
  }
}

// Warns about jobs that were stopped by the wall-time limit, perhaps due to a busy machine, and suggests a remedy.
void WarnAboutTimeLimitedJobs(ResultSource& source, std::int64_t experiment_id) {
  const Listing stopped = source.Query(db::Sql(db::Query::kClockStoppedCount, {{"experiment_id", experiment_id}}));
  const std::string warning = ClockWarning(stopped.At(0, "n").get<std::int64_t>(), experiment_id);
  if (!warning.empty()) std::cerr << "legopt: " << warning << "\n";
}

// Either --limit or the bytes of an answer.
void ReportCut(const ListOptions& options, std::size_t rows) {
  const bool by_limit = std::cmp_greater_equal(rows, options.limit);
  std::cerr << "legopt: only the first " << rows << " jobs are shown: "
            << (by_limit ? "--limit; raise it\n"
                : options.source.db
                    ? "256 MiB in memory are the limit; show fewer, for example with --tasks\n"
                    : "48 MiB are the limit of a server's answer; show fewer, for example with --tasks, or use --db\n");
}

ExitCode List(const ListOptions& options) {
  const auto source = OpenResults(options.source);
  const auto experiment = FindExperiment(*source, options.experiment);
  if (options.problem) RequireProblem(*source, experiment.id, *options.problem);
  Listing jobs = source->Query(Sql(options, experiment, *source), options.limit);
  if (!options.source.db) AddProgress(options, experiment.id, &jobs);
  PrintListing(jobs, options.listing);
  if (jobs.truncated) ReportCut(options, jobs.rows.size());
  if (options.unsolved) WarnAboutTimeLimitedJobs(*source, experiment.id);
  if (jobs.rows.empty()) std::cerr << "legopt: no job of experiment " << experiment.id << " is like that\n";
  return jobs.truncated ? ExitCode::kCutShort : ExitCode::kOk;
}

}  // namespace

void AddListCommand(const app::Command& program, Invocation* invocation) {
  using app::Alternatives, app::EnumNamesOf;
  const auto command = program.AddCommand("list", "List the jobs of an experiment");
  const auto options = std::make_shared<ListOptions>();
  command.AddOption("ID", options->experiment, "Experiment (default: the newest)").Check(app::WholeNumber(1));
  command.AddEnum<JobState>("--state", options->state, Alternatives(EnumNamesOf<JobState>()));
  AddResultFilterOptions(command, &options->filter);
  command.AddOption("--problem", options->problem, "Only this problem");
  command.AddEnum<Verdict>("--verdict", options->verdict, "Only this verdict of the judge, e.g. foot_pose",
                           {FaultOfVerdict, ""});
  command.AddFlag("--unsolved", options->unsolved, "Only jobs that ended without success");
  AddRuleOption(command, &options->rule);
  command.AddOption("--limit", options->limit, "Maximum number of jobs (default 1000)")
      .Check(app::WholeNumber(1, ResultSource::kAllRows));
  AddListingOptions(command, &options->listing);
  AddSourceOptions(command, &options->source);
  command.WhenChosen([=] { invocation->body = [options] { return List(*options); }; });
}

}  // namespace legopt::client
