#include <CLI/CLI.hpp>
#include <iostream>
#include <map>
#include <memory>

#include "client/commands.h"
#include "client/experiment_status.h"
#include "client/options.h"

namespace legopt::client {
namespace {

constexpr int kDefaultLimit = 1000;

struct Options {
  std::optional<std::int64_t> experiment;
  std::optional<std::string> state, method, task, initialization, verdict, collision;
  std::optional<int> problem;
  bool unsolved = false;
  int limit = kDefaultLimit;
  SourceOptions source;
  ListingOptions listing;
};

std::string Sql(const Options& options, std::int64_t experiment_id) {
  std::string sql =
      "SELECT job_id AS job, method, task, initialization, problem_id AS problem, repetition, state, attempts, "
      "verdict_literal AS verdict, solver_status, cost, time_s, worker FROM job_list WHERE experiment_id = " +
      std::to_string(experiment_id);
  const auto restrict = [&sql](const char* column, const std::optional<std::string>& value) {
    if (value) sql += " AND lower(" + std::string(column) + ") = lower(" + SqlText(*value) + ")";
  };
  restrict("state", options.state);
  restrict("method", options.method);
  restrict("task", options.task);
  restrict("initialization", options.initialization);
  restrict("verdict_literal", options.verdict);
  restrict("collision", options.collision);
  if (options.problem) sql += " AND problem_id = " + std::to_string(*options.problem);
  if (options.unsolved) sql += " AND (state IN ('failed', 'dead') OR verdict_literal <> 'success')";
  return sql + " ORDER BY job_id";
}

// Of leased jobs only the server knows how far they are.
void AddProgress(const Options& options, std::int64_t experiment_id, Listing* jobs) {
  ServerConnection server(options.source.network);
  std::map<std::int64_t, std::string> progress;
  for (const auto& experiment : ParseExperiments(server.Status(experiment_id))) {
    for (const auto& job : experiment.running) {
      progress[job.job] = std::to_string(job.done) + "/" + std::to_string(job.total);
    }
  }
  jobs->columns.emplace_back("progress");
  for (std::size_t i = 0; i < jobs->rows.size(); ++i) {
    const auto found = progress.find(jobs->At(i, "job").get<std::int64_t>());
    jobs->rows[i].push_back(found == progress.end() ? nlohmann::json() : nlohmann::json(found->second));
  }
}

// What a busy machine may have cost, and how to mend it.
void HintAtStoppedJobs(std::int64_t experiment_id, const Listing& jobs) {
  int stopped = 0;
  for (std::size_t i = 0; i < jobs.rows.size(); ++i) stopped += jobs.At(i, "solver_status") == "time_limit" ? 1 : 0;
  if (stopped == 0) return;
  std::cerr << "legopt: the clock stopped " << stopped << " of these; 'legopt retry " << experiment_id
            << " --time-limit' queues them again\n";
}

ExitCode List(const Options& options) {
  const auto source = OpenResults(options.source);
  const auto experiment = FindExperiment(*source, options.experiment);
  Listing jobs = source->Query(Sql(options, experiment.id), options.limit);
  if (!options.source.db) AddProgress(options, experiment.id, &jobs);
  PrintListing(jobs, options.listing);
  if (jobs.truncated) std::cerr << "legopt: only the first " << jobs.rows.size() << " jobs are shown; raise --limit\n";
  if (options.unsolved) HintAtStoppedJobs(experiment.id, jobs);
  return ExitCode::kOk;
}

}  // namespace

void AddListCommand(CLI::App& app, Invocation* invocation) {
  auto* command = app.add_subcommand("list", "List the jobs of an experiment");
  const auto options = std::make_shared<Options>();
  command->add_option("ID", options->experiment, "Experiment (default: the newest)");
  command->add_option("--state", options->state, "queued, leased, done, failed, dead or cancelled")
      ->check(CLI::IsMember({"queued", "leased", "done", "failed", "dead", "cancelled"}));
  command->add_option("--method", options->method, "Only this method");
  command->add_option("--task", options->task, "posture or motion")->check(CLI::IsMember({"posture", "motion"}));
  command->add_option("--initialization", options->initialization, "good or in_collision")
      ->check(CLI::IsMember({"good", "in_collision"}));
  command->add_option("--collision", options->collision, "Only methods with this model: solid or surface")
      ->check(CLI::IsMember({"solid", "surface"}));
  command->add_option("--problem", options->problem, "Only this problem");
  command->add_option("--verdict", options->verdict, "Only this verdict of the judge, e.g. foot_pose");
  command->add_flag("--unsolved", options->unsolved, "Only jobs that ended without success");
  command->add_option("--limit", options->limit, "Most jobs to list (default 1000)")
      ->check(CLI::Range(1, ResultSource::kAllRows));
  AddListingOptions(*command, &options->listing);
  AddSourceOptions(*command, &options->source);
  command->callback([=] { invocation->body = [options] { return List(*options); }; });
}

}  // namespace legopt::client
