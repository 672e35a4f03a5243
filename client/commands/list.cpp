#include <iostream>
#include <map>
#include <memory>
#include <utility>

#include "app/checks.h"
#include "app/command_line.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/report/benchmark_table.h"
#include "client/report/method_filter.h"
#include "client/service/experiment_status.h"
#include "legopt/input/json.h"
#include "legopt/types/job.h"
#include "legopt/types/nearest_name.h"
#include "legopt/types/result.h"
#include "legopt/types/task.h"

namespace legopt::client {
namespace {

constexpr int kDefaultLimit = 1000;

struct ListOptions {
  std::optional<std::int64_t> experiment;
  std::optional<JobState> state;
  std::optional<Task> task;
  std::optional<Initialization> initialization;
  std::optional<Verdict> verdict;
  MethodFilter methods;
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

template <NamedEnum Enum>
std::string SqlWord(Enum value) {
  return SqlText(std::string(ToString(value)));
}

// Throws if the experiment does not have the problem; otherwise the empty list would look like a problem without jobs.
void RequireProblem(ResultSource& source, std::int64_t experiment_id, int problem) {
  const Listing found = source.Query(
      "SELECT task, min(problem_id) AS first, max(problem_id) AS last, count(*) FILTER (WHERE problem_id = " +
      std::to_string(problem) + ") AS n FROM (SELECT DISTINCT c.task, p.problem_id FROM cells AS c JOIN jobs AS j " +
      "USING (cell_id) JOIN problems AS p USING (problem_key) WHERE c.experiment_id = " +
      std::to_string(experiment_id) + ") GROUP BY task");
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

// Returns SQL for the verdict by a rule. Results of old releases have no verdict by the physical rule: the one by the
// strict rule is shown.
std::string VerdictSql(Rule rule) {
  const std::string column = "verdict_" + std::string(ToString(rule));
  return rule == Rule::kSolid ? "coalesce(" + column + ", verdict_strict)" : column;
}

std::string Sql(const ListOptions& options, const ExperimentInfo& experiment, const ExperimentMethods& methods) {
  const std::string verdict = VerdictSql(options.rule.value_or(experiment.rule));
  std::string telling;
  for (const std::string& column : methods.DistinguishingColumns()) telling += column + ", ";
  std::string sql = "SELECT job_id AS job, method, " + telling +
                    "task, initialization, problem_id AS problem, repetition, state, attempts, " + verdict +
                    " AS verdict, solver_status, cost, time_s, worker FROM job_list WHERE "
                    "experiment_id = " +
                    std::to_string(experiment.id);
  const auto restrict = [&sql](const std::string& column, const auto& value) {
    if (value) sql += " AND " + column + " = " + SqlWord(*value);
  };
  restrict("state", options.state);
  restrict("task", options.task);
  restrict("initialization", options.initialization);
  restrict(verdict, options.verdict);
  if (const std::string condition = methods.Condition(options.methods); !condition.empty()) {
    sql += " AND job_id IN (SELECT job_id FROM jobs JOIN cells USING (cell_id) WHERE " + condition + ")";
  }
  if (options.problem) sql += " AND problem_id = " + std::to_string(*options.problem);
  if (options.unsolved) {
    sql += " AND (state IN (" + SqlWord(JobState::kFailed) + ", " + SqlWord(JobState::kDead) + ") OR " + verdict +
           " <> " + SqlWord(Verdict::kSuccess) + ")";
  }
  return sql + " ORDER BY job_id";
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
  const Listing stopped =
      source.Query("SELECT count(*) AS n FROM clock_stopped WHERE experiment_id = " + std::to_string(experiment_id));
  const std::string warning = ClockWarning(stopped.At(0, "n").get<std::int64_t>(), experiment_id);
  if (!warning.empty()) std::cerr << "legopt: " << warning << "\n";
}

// Either --limit or the bytes of an answer.
void ReportCut(const ListOptions& options, std::size_t rows) {
  const bool by_limit = std::cmp_greater_equal(rows, options.limit);
  std::cerr << "legopt: only the first " << rows << " jobs are shown: "
            << (by_limit ? "--limit; raise it\n"
                : options.source.db
                    ? "256 MiB in memory are the limit; show fewer, for example with --task\n"
                    : "48 MiB are the limit of a server's answer; show fewer, for example with --task, or use --db\n");
}

ExitCode List(const ListOptions& options) {
  const auto source = OpenResults(options.source);
  const auto experiment = FindExperiment(*source, options.experiment);
  if (options.problem) RequireProblem(*source, experiment.id, *options.problem);
  Listing jobs = source->Query(Sql(options, experiment, {*source, experiment.id}), options.limit);
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
  AddMethodFilterOptions(command, &options->methods);
  command.AddEnum<Task>("--task", options->task, Alternatives(EnumNamesOf<Task>()));
  command.AddEnum<Initialization>("--initialization", options->initialization,
                                  Alternatives(EnumNamesOf<Initialization>()));
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
