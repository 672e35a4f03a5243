#include "server/status.h"

#include <string>

namespace legopt::server {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMostRunningShown = 1000;  // keeps a reply small, however large the pool

Json ExperimentJson(const db::ExperimentSummary& summary, const Scheduler& scheduler) {
  Json jobs{{"total", summary.num_jobs}};
  for (int state = 0; state < db::kNumJobStates; ++state) {
    jobs[std::string(db::ToString(static_cast<db::JobState>(state)))] = summary.jobs_by_state[state];
  }
  Json running = Json::array();
  for (const JobProgress& job : scheduler.Progress(summary.experiment_id, kMostRunningShown)) {
    running.push_back({{"job", job.job_id},
                       {"task", job.task},
                       {"worker", job.worker_id},
                       {"progress_done", job.done},
                       {"progress_total", job.total}});
  }
  return {{"id", summary.experiment_id},
          {"name", summary.name},
          {"state", db::ToString(summary.state)},
          {"hold", db::ToString(summary.control.hold)},
          {"hold_reason", summary.control.reason},
          {"priority", summary.control.priority},
          {"jobs", std::move(jobs)},
          {"running", std::move(running)},
          {"solved", summary.solved},
          {"submitted_at_us", summary.submitted_at_us},
          {"finished_at_us", summary.finished_at_us == 0 ? Json() : Json(summary.finished_at_us)}};
}

Json WorkerJson(const WorkerStatus& worker, const Instant& now) {
  constexpr double kSecondsPerMicrosecond = 1e-6;
  std::string datasets;
  for (const db::DatasetRecord& dataset : worker.datasets) datasets += (datasets.empty() ? "" : ", ") + dataset.name;
  const double silent_s = static_cast<double>((now.steady - worker.last_seen).count()) * kSecondsPerMicrosecond;
  return {{"id", worker.record.worker_id},
          {"name", worker.record.name},
          {"hostname", worker.record.hostname},
          {"pid", worker.record.pid},
          {"slots", worker.record.slots},
          {"leases", worker.leases},
          {"online", worker.online},
          {"silent_s", worker.online ? Json(silent_s) : Json()},
          {"datasets", std::move(datasets)},
          {"build", worker.record.build}};
}

}  // namespace

Json StatusJson(const Scheduler& scheduler, std::int64_t experiment_id, const Instant& now) {
  Json experiments = Json::array();
  for (const auto& [id, summary] : scheduler.experiments()) {
    if (experiment_id == 0 || experiment_id == id) experiments.push_back(ExperimentJson(summary, scheduler));
  }
  Json workers = Json::array();
  for (const WorkerStatus& worker : scheduler.workers()) workers.push_back(WorkerJson(worker, now));
  Json counters = Json::object();
  for (const auto& [name, value] : scheduler.counters().Listing()) counters[std::string(name)] = value;
  Json server{
      {"queued", scheduler.num_queued()}, {"leased", scheduler.num_leases()}, {"scheduler", std::move(counters)}};
  return {{"experiments", std::move(experiments)}, {"workers", std::move(workers)}, {"server", std::move(server)}};
}

}  // namespace legopt::server
