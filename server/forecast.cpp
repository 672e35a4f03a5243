#include "server/forecast.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <utility>

namespace legopt::server {
namespace {

// Number of last jobs that are assigned to slots one by one; the jobs before them are spread evenly.
constexpr std::int64_t kDealtOneByOne = 1024;
constexpr double kOverdueShare = 0.25;

struct Exposure {
  double seconds = 0, waypoints = 0;

  void Add(const Exposure& other) {
    seconds += other.seconds;
    waypoints += other.waypoints;
  }
  std::optional<double> rate() const { return waypoints > 0 ? std::optional(seconds / waypoints) : std::nullopt; }
};

// Returns the finished share of the job, [0, 1]; 0: unknown. On average, half of the current window is done.
double ShareDone(const RunningWork& job) {
  if (job.windows_solved == 0) return 0;
  return std::min((job.windows_solved + 0.5) / job.windows, 1.0);
}

std::vector<Exposure> ExposureOfKinds(const WorkLeft& left) {
  std::vector<Exposure> exposure;
  for (const JobKind& kind : left.kinds) exposure.push_back({kind.seconds, kind.waypoints});
  for (const RunningWork& job : left.running) {
    if (ShareDone(job) > 0) exposure[job.kind].Add({job.elapsed_s, ShareDone(job) * job.waypoints});
  }
  const std::vector<Exposure> measured = exposure;
  for (const RunningWork& job : left.running) {
    const std::optional<double> rate = measured[job.kind].rate();
    if (rate && ShareDone(job) == 0) {
      exposure[job.kind].seconds += std::max(job.elapsed_s - *rate * job.waypoints, 0.0);
    }
  }
  return exposure;
}

double RemainingOf(const RunningWork& job, double seconds_per_waypoint) {
  const double expected = seconds_per_waypoint * job.waypoints;
  const double at_most = std::max(job.limit_s - job.elapsed_s, 0.0);
  if (const double done = ShareDone(job); done > 0) {
    const double by_itself = job.elapsed_s / done * (1 - done);
    const double by_kind = expected * (1 - done);
    return std::min(done * by_itself + (1 - done) * by_kind, at_most);
  }
  return std::min(std::max(expected - job.elapsed_s, kOverdueShare * job.elapsed_s), at_most);
}

// Times at which the slots become free, earliest first.
class Slots {
 public:
  Slots(const std::vector<double>& busy_s, std::size_t count) {
    for (const double busy : busy_s) free_at_.push_back(busy);
    free_at_.resize(std::max(count, free_at_.size()), 0.0);
    std::make_heap(free_at_.begin(), free_at_.end(), std::greater<>());
  }

  void Deal(double duration_s) {
    std::pop_heap(free_at_.begin(), free_at_.end(), std::greater<>());
    free_at_.back() += duration_s;
    std::push_heap(free_at_.begin(), free_at_.end(), std::greater<>());
  }

  // Distributes divisible work: fills the earliest slots up to a common time.
  void Pour(double work_s) {
    std::sort(free_at_.begin(), free_at_.end());
    double level = free_at_.front();
    std::size_t filled = 1;
    while (filled < free_at_.size() && work_s >= static_cast<double>(filled) * (free_at_[filled] - level)) {
      work_s -= static_cast<double>(filled) * (free_at_[filled] - level);
      level = free_at_[filled++];
    }
    level += work_s / static_cast<double>(filled);
    std::fill_n(free_at_.begin(), filled, level);  // still sorted, hence a heap
  }

  double last() const { return *std::max_element(free_at_.begin(), free_at_.end()); }

 private:
  std::vector<double> free_at_;
};

}  // namespace

std::vector<std::optional<double>> SecondsPerWaypoint(const WorkLeft& left) {
  const std::vector<Exposure> exposure = ExposureOfKinds(left);
  std::map<std::pair<std::size_t, Task>, Exposure> known;  // method and task of kinds that have an ended job
  for (const JobKind& kind : left.kinds) {
    if (kind.waypoints > 0) known.try_emplace({kind.method, kind.task});
  }
  for (std::size_t i = 0; i < left.kinds.size(); ++i) {
    const auto found = known.find({left.kinds[i].method, left.kinds[i].task});
    if (found != known.end()) found->second.Add(exposure[i]);
  }
  std::vector<std::optional<double>> rates;
  for (std::size_t i = 0; i < left.kinds.size(); ++i) {
    const auto found = known.find({left.kinds[i].method, left.kinds[i].task});
    std::optional<double> rate;
    if (found != known.end()) rate = exposure[i].rate() ? exposure[i].rate() : found->second.rate();
    rates.push_back(rate);
  }
  return rates;
}

std::optional<double> EstimateRemaining_s(const WorkLeft& left) {
  if (left.running.empty() || left.slots <= 0) return std::nullopt;
  const auto rates = SecondsPerWaypoint(left);
  const auto unknown = [&](const auto& work) { return !rates[work.kind]; };
  if (std::any_of(left.running.begin(), left.running.end(), unknown)) return std::nullopt;
  if (std::any_of(left.queued.begin(), left.queued.end(), unknown)) return std::nullopt;

  std::vector<double> busy_s;
  for (const RunningWork& job : left.running) busy_s.push_back(RemainingOf(job, *rates[job.kind]));
  const std::size_t machines = std::max(static_cast<std::size_t>(std::ceil(left.slots)), busy_s.size());
  Slots slots(busy_s, machines);
  const double stretch = static_cast<double>(machines) / left.slots;  // a shared slot takes longer
  std::int64_t waiting = 0;
  for (const QueuedWork& work : left.queued) waiting += work.count;
  for (const QueuedWork& work : left.queued) {
    const double duration_s = *rates[work.kind] * work.waypoints * stretch;
    const std::int64_t poured = std::clamp<std::int64_t>(waiting - kDealtOneByOne, 0, work.count);
    if (poured > 0) slots.Pour(duration_s * static_cast<double>(poured));
    for (std::int64_t i = poured; i < work.count; ++i) slots.Deal(duration_s);
    waiting -= work.count;
  }
  return slots.last();
}

namespace {

double Seconds(microseconds duration) { return static_cast<double>(duration.count()) * kSecondsPerMicrosecond; }

std::string Quoted(const std::string& name) { return "'" + name + "'"; }

std::string NameOf(const db::ExperimentSummary& summary) {
  return "experiment " + std::to_string(summary.experiment_id) + " " + Quoted(summary.name);
}

std::string OtherBuilds(const db::ExperimentSummary& summary, const std::set<std::string>& builds) {
  std::string list;
  for (const std::string& build : builds) list += (list.empty() ? "" : ", ") + build;
  return "no worker is of build " + summary.control.build_id + ", which began it (the workers are of build " + list +
         "); start one, or let any build finish it: 'legopt resume " + std::to_string(summary.experiment_id) +
         " --any-build'";
}

// Merges adjacent jobs of the same kind and size, so that a cell of postures is a single entry.
void AddQueued(std::vector<QueuedWork>& queued, std::size_t kind, double waypoints) {
  if (!queued.empty() && queued.back().kind == kind && queued.back().waypoints == waypoints) {
    ++queued.back().count;
  } else {
    queued.push_back({kind, waypoints, 1});
  }
}

}  // namespace

ForecastSnapshot::ForecastSnapshot(const Scheduler& scheduler, const Instant& now, std::string store_error)
    : scheduler_(scheduler), now_(now), store_error_(std::move(store_error)) {
  for (WorkerStatus& worker : scheduler.workers()) {
    const std::int64_t id = worker.record.worker_id;
    workers_.emplace(id, std::move(worker));
  }
  std::map<std::int64_t, int> begun;  // worker -> number of running leases
  for (const LeaseView& lease : scheduler.LeasesInOrder()) {
    const auto worker = workers_.find(lease.worker_id);
    if (worker == workers_.end() || !IsResponsive(worker->second)) {
      waiting_for_silent_workers_.insert(lease.experiment_id);
      continue;
    }
    if (++begun[lease.worker_id] > worker->second.record.slots) continue;  // waits for a slot of its worker
    worked_on_[lease.experiment_id].push_back(lease);
    ++busy_slots_;
  }
}

bool ForecastSnapshot::IsResponsive(const WorkerStatus& worker) const {
  constexpr int kMissedHeartbeats = 6;
  return worker.last_seen > microseconds(0) &&
         now_.steady - worker.last_seen <= kMissedHeartbeats * scheduler_.options().heartbeat;
}

bool ForecastSnapshot::IsSuitable(const WorkerStatus& worker, const Experiment& experiment) const {
  return worker.online && scheduler_.CanWorkOn(worker.profile, experiment);
}

ExperimentForecast ForecastSnapshot::Of(std::int64_t experiment_id) const {
  ExperimentForecast outlook;
  const Experiment* experiment = scheduler_.InMemory(experiment_id);
  const db::ExperimentSummary& summary = scheduler_.experiments().at(experiment_id);
  if (experiment == nullptr || summary.state != db::ExperimentState::kActive) return outlook;
  outlook.left = Left(*experiment);
  outlook.missing = Missing(*experiment);
  outlook.waiting_for = WaitingFor(summary, *experiment);
  if (busy_slots_ > 0) {
    outlook.share = static_cast<double>(outlook.left.running.size()) / static_cast<double>(busy_slots_);
  }
  if (outlook.waiting_for.empty()) outlook.remaining_s = EstimateRemaining_s(outlook.left);
  return outlook;
}

std::string ForecastSnapshot::StallReason(std::int64_t experiment_id) const {
  const Experiment* experiment = scheduler_.InMemory(experiment_id);
  const db::ExperimentSummary& summary = scheduler_.experiments().at(experiment_id);
  if (experiment == nullptr || summary.state != db::ExperimentState::kActive) return {};
  const std::string reason = WaitingFor(summary, *experiment);
  return busy_slots_ > 0 && !reason.empty() && reason == OccupyingExperiments(*experiment) ? std::string() : reason;
}

// --- Reasons for stalls ----------------------------------------------------------------------------------------------

std::string ForecastSnapshot::WaitingFor(const db::ExperimentSummary& summary, const Experiment& experiment) const {
  if (!store_error_.empty()) return "the database cannot be written: " + store_error_;
  const std::string id = std::to_string(summary.experiment_id);
  if (summary.control.hold == db::ExperimentHold::kPaused) {
    const std::string& reason = summary.control.reason;
    return "paused" + (reason.empty() ? "" : ": " + reason) + "; 'legopt resume " + id + "' continues it";
  }
  if (scheduler_.draining()) return "the server is stopping";
  if (worked_on_.contains(summary.experiment_id)) return {};
  return WaitingForWorkers(experiment);
}

std::string ForecastSnapshot::WaitingForWorkers(const Experiment& experiment) const {
  int online = 0, loading = 0, able = 0, heard = 0;
  for (const auto& [id, worker] : workers_) {
    const bool may = IsSuitable(worker, experiment);
    online += worker.online ? 1 : 0;
    loading += worker.online && !worker.profile.abilities.HasLoaded() && IsResponsive(worker) ? 1 : 0;
    able += may ? 1 : 0;
    heard += may && IsResponsive(worker) ? 1 : 0;
  }
  const std::int64_t experiment_id = experiment.experiment_id();
  const db::ExperimentSummary& summary = scheduler_.experiments().at(experiment_id);
  const bool all_taken = summary.jobs_by_state[db::JobState::kQueued] == 0;
  if (waiting_for_silent_workers_.contains(experiment_id) && (heard == 0 || all_taken)) {
    return "nothing is heard of the workers that have its jobs";
  }
  if (heard > 0) return OccupyingExperiments(experiment);
  if (loading > 0) return "workers load the dataset";
  if (able > 0) return "nothing is heard of the workers any more";
  if (online == 0) return "no worker is connected; start one with 'legopt-worker --slots 2'";
  const std::vector<std::string> missing = Missing(experiment);
  return missing.empty() ? "no worker takes its jobs" : missing.front();
}

// --- Missing capabilities --------------------------------------------------------------------------------------------

// Empty while workers are loading, because they may have the missing capability.
std::vector<std::string> ForecastSnapshot::Missing(const Experiment& experiment) const {
  std::vector<std::string> missing;
  int online = 0;
  for (const auto& [id, worker] : workers_) {
    if (worker.online && !worker.profile.abilities.HasLoaded() && IsResponsive(worker)) return missing;
    online += worker.online ? 1 : 0;
  }
  if (online == 0) return missing;
  for (const Experiment::Group& group : experiment.groups()) {
    if (group.queued == 0 || group.able_workers > 0) continue;
    const std::string text = MissingFor(experiment, group);
    if (std::find(missing.begin(), missing.end(), text) == missing.end()) missing.push_back(text);
  }
  return missing;
}

std::string ForecastSnapshot::MissingFor(const Experiment& experiment, const Experiment::Group& group) const {
  std::vector<JobRequirement> unmet_individually =
      scheduler_.NeedsOf(experiment, group);                 // needs that no worker satisfies individually
  std::vector<JobRequirement> nearest = unmet_individually;  // unsatisfied needs of the best worker
  std::set<std::string> other_builds;                        // builds of workers that differ only in their
                                                             // build
  std::optional<std::string> refusal;
  for (const auto& [id, worker] : workers_) {
    if (!worker.online) continue;
    const std::vector<JobRequirement> lacks =
        scheduler_.UnmetNeeds(worker.profile, scheduler_.NeedsOf(experiment, group));
    if (lacks.empty()) {
      const auto refused = worker.profile.refused.find({group.method_hash, group.task});
      if (refused != worker.profile.refused.end()) refusal = refused->second;
    }
    if (lacks.size() == 1 && lacks.front().kind == JobRequirement::Kind::kBuild)
      other_builds.insert(worker.record.build_id);
    if (lacks.size() < nearest.size()) nearest = lacks;
    unmet_individually = scheduler_.UnmetNeeds(worker.profile, unmet_individually);
  }
  if (refusal) return "workers refuse its jobs: " + *refusal;
  if (!other_builds.empty()) {
    return OtherBuilds(scheduler_.experiments().at(experiment.experiment_id()), other_builds);
  }
  const bool together = unmet_individually.empty();  // each need is satisfied somewhere, but no worker satisfies all
  std::string text;
  for (const JobRequirement& need : together ? nearest : unmet_individually)
    text += (text.empty() ? "" : " and ") + TextOf(need);
  return "no worker has " + text + (together ? " beside the rest of what its jobs need; " : "; ") +
         RemedyOf((together ? nearest : unmet_individually).front());
}

// Returns which other experiments occupy the suitable workers.
std::string ForecastSnapshot::OccupyingExperiments(const Experiment& experiment) const {
  const int priority = scheduler_.experiments().at(experiment.experiment_id()).control.priority;
  const db::ExperimentSummary* other = nullptr;
  for (const auto& [id, leases] : worked_on_) {
    const db::ExperimentSummary& summary = scheduler_.experiments().at(id);
    const bool able = std::any_of(leases.begin(), leases.end(), [&](const LeaseView& lease) {
      return IsSuitable(workers_.at(lease.worker_id), experiment);
    });
    if (able && (other == nullptr || summary.control.priority > other->control.priority)) other = &summary;
  }
  if (other == nullptr) return "its workers take no jobs at the moment: they are starting or stopping";
  if (other->control.priority > priority) {
    return NameOf(*other) + " goes first, by its priority of " + std::to_string(other->control.priority);
  }
  return "the workers are busy with " + NameOf(*other);
}

// --- Remaining time --------------------------------------------------------------------------------------------------

WorkLeft ForecastSnapshot::Left(const Experiment& experiment) const {
  const ExperimentSpec& spec = experiment.spec();
  WorkLeft left;
  std::int64_t index = 0;
  std::vector<std::vector<QueuedWork>> queued(spec.tasks.size());  // by task
  for (std::size_t method = 0; method < spec.methods.size(); ++method) {
    for (std::size_t task_index = 0; task_index < spec.tasks.size(); ++task_index) {
      const ExperimentSpec::TaskProblems& task = spec.tasks[task_index];
      for (std::size_t start = 0; start < spec.initializations.size(); ++start) {
        const std::size_t kind = left.kinds.size();
        const KindTime& time = experiment.kind_time(kind);
        left.kinds.push_back({method, task.task, time.seconds, time.waypoints});
        for (const int waypoints : task.waypoints) {
          for (int repetition = 0; repetition < spec.repetitions; ++repetition, ++index) {
            if (experiment.job(index).state == db::JobState::kQueued) AddQueued(queued[task_index], kind, waypoints);
          }
        }
      }
    }
  }
  for (const auto& of_task : queued) left.queued.insert(left.queued.end(), of_task.begin(), of_task.end());
  const auto worked_on = worked_on_.find(experiment.experiment_id());
  if (worked_on == worked_on_.end()) return left;
  for (const LeaseView& lease : worked_on->second) {
    const std::int64_t at_index = lease.job_id - experiment.first_job_id();
    const JobCoordinates at = CoordinatesOf(spec, at_index);
    const ExperimentSpec::TaskProblems& task = spec.tasks[at.task];
    RunningWork& running = left.running.emplace_back();
    running.kind = experiment.KindOf(at_index);
    running.waypoints = task.waypoints[at.problem];
    running.elapsed_s = Seconds(now_.steady - lease.since);
    running.limit_s = static_cast<double>(task.wall_limit_us) * kSecondsPerMicrosecond;
    if (!DescriptionOf(task.task).windowed)
      continue;  // the number of attempts does not predict the remaining time:
                 // the first success is the last attempt
    running.windows_solved = static_cast<int>(lease.progress_done);
    running.windows = static_cast<int>(lease.progress_total);
  }
  left.slots = SlotsFor(experiment);
  return left;
}

// Returns the expected number of slots: all suitable slots for a single experiment; its fair share among experiments of
// its priority; its current slots if there are experiments of larger priority.
double ForecastSnapshot::SlotsFor(const Experiment& experiment) const {
  const db::ExperimentSummary& mine = scheduler_.experiments().at(experiment.experiment_id());
  std::set<std::string> submitters;
  int of_mine = 0;
  for (const auto& [id, other] : scheduler_.experiments()) {
    if (!CompetesForSlots(other)) continue;
    if (other.control.priority > mine.control.priority) {
      return static_cast<double>(worked_on_.at(experiment.experiment_id()).size());
    }
    if (other.control.priority < mine.control.priority) continue;
    submitters.insert(other.submitter);
    of_mine += other.submitter == mine.submitter ? 1 : 0;
  }
  int slots = 0;
  for (const auto& [id, worker] : workers_) {
    if (IsResponsive(worker) && IsSuitable(worker, experiment)) slots += worker.record.slots;
  }
  const double parts = static_cast<double>(std::max<std::size_t>(submitters.size(), 1)) * std::max(of_mine, 1);
  return std::max(slots, 1) / parts;
}

// Returns whether the scheduler assigns slots to the experiment, or has assigned some.
bool ForecastSnapshot::CompetesForSlots(const db::ExperimentSummary& summary) const {
  if (summary.state != db::ExperimentState::kActive || summary.control.hold != db::ExperimentHold::kNone) return false;
  return summary.jobs_by_state[db::JobState::kQueued] > 0 || worked_on_.contains(summary.experiment_id);
}

}  // namespace legopt::server
