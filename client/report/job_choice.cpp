#include "client/report/job_choice.h"

#include <string>

#include "app/checks.h"
#include "client/client_error.h"
#include "db/named_queries.h"
#include "legopt/input/json.h"

namespace legopt::client {
namespace {

// Returns e.g. "experiment 3 with --methods SQP --problem 4".
std::string Described(const JobChoice& choice, std::int64_t experiment_id) {
  std::string options = Describe(choice.filter);
  if (choice.problem) options += (options.empty() ? "" : " ") + ("--problem " + std::to_string(*choice.problem));
  return "experiment " + std::to_string(experiment_id) + (options.empty() ? "" : " with " + options);
}

}  // namespace

void AddJobChoiceOptions(const app::Command& command, JobChoice* choice) {
  command
      .AddOption("--experiment", choice->experiment,
                 "Choose the job from this experiment by the options below (default: the newest)")
      .Check(app::WholeNumber(1));
  AddResultFilterOptions(command, &choice->filter);
}

std::int64_t ChooseJob(ResultSource& source, const JobChoice& choice) {
  constexpr int kMostNamed = 5;
  const ExperimentInfo experiment = FindExperiment(source, choice.experiment);
  const KeptCells kept(source, experiment.id, choice.filter);
  const Listing jobs = source.Query(db::Sql(db::Query::kJobListing, {{"experiment_id", experiment.id},
                                                                     {"rule", experiment.rule},
                                                                     {"cell_ids", kept.ids()},
                                                                     {"problem_id", choice.problem}}),
                                    kMostNamed);
  if (jobs.rows.size() == 1) return jobs.At(0, "job").get<std::int64_t>();
  const std::string described = Described(choice, experiment.id);
  if (jobs.rows.empty()) throw ClientError(ExitCode::kUsage, "there is no job of " + described);
  std::string numbers;
  for (std::size_t i = 0; i < jobs.rows.size(); ++i) numbers += (i == 0 ? "" : ", ") + Dump(jobs.At(i, "job"));
  throw ClientError(ExitCode::kUsage, "there are several jobs of " + described + ": " + numbers +
                                          (jobs.truncated ? ", ..." : "") +
                                          "; name one of them, or add --problem, --methods, --tasks or "
                                          "--initializations");
}

}  // namespace legopt::client
