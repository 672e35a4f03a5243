#include "server/status.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "server/forecast.h"

namespace legopt::server {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMaxRunningShown = 1000;  // bounds the size of a reply

Json RunningJson(const std::vector<JobProgress>& jobs) {
  Json running = Json::array();
  for (const JobProgress& job : jobs) {
    running.push_back({{"job", job.job_id},
                       {"task", ToString(job.task)},
                       {"worker", job.worker_id},
                       {"progress_done", job.done},
                       {"progress_total", job.total}});
  }
  return running;
}

// Adds the times of the experiment. The working time is known only while it is in memory.
void AddTimes(Json& json, const db::ExperimentSummary& summary, const Experiment* experiment, const Instant& now) {
  const std::int64_t end_us = summary.finished_at_us == 0 ? now.wall_us : summary.finished_at_us;
  const double elapsed_s =
      static_cast<double>(std::max<std::int64_t>(end_us - summary.submitted_at_us, 0)) * kSecondsPerMicrosecond;
  json["submitted_at_us"] = summary.submitted_at_us;
  json["finished_at_us"] = summary.finished_at_us == 0 ? Json() : Json(summary.finished_at_us);
  json["elapsed_s"] = elapsed_s;
  json["worked_s"] = nullptr;
  if (experiment != nullptr) {
    json["worked_s"] = std::min(static_cast<double>(experiment->worked.count()) * kSecondsPerMicrosecond, elapsed_s);
  }
}

Json KindsJson(const Experiment& experiment, const WorkLeft& left) {
  const ExperimentSpec& spec = experiment.spec();
  const auto rates = SecondsPerWaypoint(left);
  std::vector<std::int64_t> queued(left.kinds.size());
  for (const QueuedWork& work : left.queued) queued[work.kind] += work.count;
  Json kinds = Json::array();
  for (std::size_t kind = 0; kind < left.kinds.size(); ++kind) {
    kinds.push_back({{"method", spec.methods[left.kinds[kind].method].name},
                     {"task", ToString(left.kinds[kind].task)},
                     {"initialization", ToString(spec.initializations[kind % spec.initializations.size()])},
                     {"queued", queued[kind]},
                     {"s_per_waypoint", rates[kind] ? Json(*rates[kind]) : Json()}});
  }
  return kinds;
}

Json ExperimentJson(const db::ExperimentSummary& summary, const Scheduler& scheduler, const ForecastSnapshot& outlooks,
                    bool with_kinds, const Instant& now) {
  Json jobs{{"total", summary.num_jobs}};
  for (const auto& [state, word] : kEnumNames<JobState>) jobs[std::string(word)] = summary.jobs_by_state[state];
  const ExperimentForecast outlook = outlooks.Of(summary.experiment_id);
  const Experiment* experiment = scheduler.InMemory(summary.experiment_id);
  Json json{{"id", summary.experiment_id},
            {"name", summary.name},
            {"spec_hash", summary.spec_hash},
            {"submitter", summary.submitter},
            {"tags", summary.tags},
            {"dataset", summary.dataset},
            {"methods", summary.methods},
            {"state", ToString(summary.state)},
            {"hold", ToString(summary.control.hold)},
            {"hold_reason", summary.control.reason},
            {"priority", summary.control.priority},
            {"builds", ToString(summary.control.builds)},
            {"build_id", summary.control.build_id},
            {"jobs", std::move(jobs)},
            {"running", RunningJson(scheduler.Progress(summary.experiment_id, kMaxRunningShown))},
            {"rule", ToString(summary.rule)},
            {"solved", summary.solved},
            {"taken_over", summary.taken_over},
            {"share", outlook.share},
            {"eta_s", outlook.remaining_s ? Json(*outlook.remaining_s) : Json()},
            {"waiting_for", outlook.waiting_for},
            {"missing", outlook.missing}};
  AddTimes(json, summary, experiment, now);
  if (with_kinds && !outlook.left.kinds.empty()) json["kinds"] = KindsJson(*experiment, outlook.left);
  return json;
}

std::string Joined(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  return list;
}

double SecondsOf(microseconds duration) { return static_cast<double>(duration.count()) * kSecondsPerMicrosecond; }

Json WorkerJson(const WorkerStatus& worker, const Instant& now) {
  const WorkerCapabilities& abilities = worker.profile.abilities;
  const std::int64_t silent_us =
      worker.online ? (now.steady - worker.last_seen).count() : now.wall_us - worker.record.seen_at_us;
  const double silent_s = static_cast<double>(std::max<std::int64_t>(silent_us, 0)) * kSecondsPerMicrosecond;
  return {{"id", worker.record.worker_id},
          {"name", worker.record.name},
          {"hostname", worker.record.hostname},
          {"pid", worker.record.pid},
          {"slots", worker.record.slots},
          {"leases", worker.leases},
          {"online", worker.online},
          {"draining", worker.profile.draining},
          {"silent_s", silent_s},
          {"datasets", Joined(abilities.Names(CapabilityKind::kDataset))},
          {"solvers", Joined(abilities.Names(CapabilityKind::kSolver))},
          {"build", worker.record.build},
          {"build_id", worker.record.build_id},
          {"processor", worker.record.processor},
          {"processors", worker.record.processors},
          {"memory_bytes", worker.record.memory_bytes},
          {"load", std::isfinite(worker.record.load) ? Json(worker.record.load) : Json()}};
}

/// Workers in a reply.
struct ListedWorkers {
  Json list = Json::array();
  std::size_t omitted = 0;  ///< workers that never leased a job and are not listed
};

/// Lists all workers that leased jobs, and of the others the last to be heard: any process can say hello as often as it
/// likes, and the reply has a limit.
ListedWorkers WorkersJson(const Scheduler& scheduler, const Instant& now) {
  constexpr std::size_t kMostNew = 1000;
  std::vector<WorkerStatus> workers = scheduler.workers();
  std::vector<microseconds> heard;
  for (const WorkerStatus& worker : workers) {
    if (!worker.enlisted) heard.push_back(worker.last_seen);
  }
  ListedWorkers listed;
  listed.omitted = heard.size() - std::min(heard.size(), kMostNew);
  std::ranges::sort(heard);
  const microseconds first = listed.omitted > 0 ? heard[listed.omitted] : microseconds::min();
  std::size_t left = std::min(heard.size(), kMostNew);
  for (const WorkerStatus& worker : workers) {
    if (!worker.enlisted && (worker.last_seen < first || left == 0)) continue;
    if (!worker.enlisted) --left;
    listed.list.push_back(WorkerJson(worker, now));
  }
  return listed;
}

}  // namespace

Json StatusJson(const Scheduler& scheduler, std::int64_t experiment_id, const Instant& now,
                const std::string& store_error) {
  const ForecastSnapshot outlooks(scheduler, now, store_error);
  Json experiments = Json::array();
  for (const auto& [id, summary] : scheduler.experiments()) {
    if (experiment_id != 0 && experiment_id != id) continue;
    experiments.push_back(ExperimentJson(summary, scheduler, outlooks, experiment_id != 0, now));
  }
  ListedWorkers workers = WorkersJson(scheduler, now);
  Json counters = Json::object();
  for (const auto& [name, value] : scheduler.counters().Listing()) counters[std::string(name)] = value;
  const auto oldest = scheduler.oldest_lease();
  Json server{{"queued", scheduler.num_queued()},
              {"leased", scheduler.num_leases()},
              {"oldest_lease_s", oldest ? Json(SecondsOf(now.steady - *oldest)) : Json()},
              {"store_error", store_error},
              {"workers_not_listed", workers.omitted},
              {"scheduler", std::move(counters)}};
  return {{"experiments", std::move(experiments)}, {"workers", std::move(workers.list)}, {"server", std::move(server)}};
}

}  // namespace legopt::server
