// Read access to the scheduler's state.

#include <algorithm>
#include <iterator>
#include <set>

#include "server/scheduler.h"

namespace legopt::server {

std::vector<JobProgress> Scheduler::Progress(std::int64_t experiment_id, std::size_t most) const {
  std::vector<JobProgress> list;
  const auto open = open_.find(experiment_id);
  if (open == open_.end()) return list;
  const Experiment& experiment = *open->second;
  const std::int64_t first = experiment.first_job_id();
  const auto end = leases_.lower_bound(first + experiment.num_jobs());
  for (auto lease = leases_.lower_bound(first); lease != end && list.size() < most; ++lease) {
    const LeaseState& state = lease->second;
    if (state.progress_total == 0) continue;
    list.push_back({lease->first, experiment.TaskOf(lease->first - first), state.worker_id, state.progress_done,
                    state.progress_total});
  }
  return list;
}

std::vector<LeaseView> Scheduler::LeasesInOrder() const {
  std::vector<std::pair<std::int64_t, std::int64_t>> in_order;  // order, job
  for (const auto& [job_id, lease] : leases_) in_order.emplace_back(lease.order, job_id);
  std::sort(in_order.begin(), in_order.end());
  std::vector<LeaseView> views;
  for (const auto& [order, job_id] : in_order) {
    const LeaseState& lease = leases_.at(job_id);
    const Experiment* experiment = std::prev(by_first_job_.upper_bound(job_id))->second;
    views.push_back(
        {job_id, experiment->experiment_id(), lease.worker_id, lease.since, lease.progress_done, lease.progress_total});
  }
  return views;
}

// Workers choose a new identity at every start, so offline ones accumulate.
std::vector<WorkerStatus> Scheduler::workers() const {
  std::vector<std::pair<std::int64_t, std::int64_t>> gone;  // last seen, id
  std::set<std::int64_t> shown;
  for (const auto& [id, worker] : workers_) {
    if (worker.online || worker.leases > 0) {
      shown.insert(id);
    } else if (worker.record.seen_at_us > wall_us_ - options_.offline_shown.count()) {
      gone.emplace_back(worker.record.seen_at_us, id);
    }
  }
  std::sort(gone.rbegin(), gone.rend());
  gone.resize(std::min(gone.size(), options_.most_offline_shown));
  for (const auto& [seen, id] : gone) shown.insert(id);
  std::vector<WorkerStatus> list;
  for (const std::int64_t id : shown) {
    const Worker& worker = workers_.at(id);
    list.push_back({worker.record, worker.online, worker.last_seen, worker.leases, worker.profile});
  }
  return list;
}

std::optional<microseconds> Scheduler::oldest_lease() const {
  std::optional<microseconds> oldest;
  for (const auto& [job_id, lease] : leases_) oldest = oldest ? std::min(*oldest, lease.since) : lease.since;
  return oldest;
}

const Experiment* Scheduler::InMemory(std::int64_t experiment_id) const {
  const auto open = open_.find(experiment_id);
  return open == open_.end() ? nullptr : open->second.get();
}

// A late tick (no work to do, or a store error) does not show how long the jobs ran since the previous tick.
void Scheduler::CountWork(microseconds elapsed) {
  constexpr microseconds kLongest = std::chrono::seconds(1);
  for (const auto& [id, experiment] : open_) {
    const std::int64_t leased = summaries_.at(id).jobs_by_state[db::JobState::kLeased];
    if (leased > 0) experiment->worked += std::min(elapsed, kLongest);
  }
}

}  // namespace legopt::server
