// What the scheduler tells of itself, beyond its replies.

#include <algorithm>
#include <iterator>

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

const Experiment* Scheduler::InMemory(std::int64_t experiment_id) const {
  const auto open = open_.find(experiment_id);
  return open == open_.end() ? nullptr : open->second.get();
}

// A tick that comes late (nothing was to do, or the store failed) does not tell what was done since the last one.
void Scheduler::CountWork(microseconds elapsed) {
  constexpr microseconds kLongest = std::chrono::seconds(1);
  for (const auto& [id, experiment] : open_) {
    const std::int64_t leased = summaries_.at(id).jobs_by_state[db::JobState::kLeased];
    if (leased > 0) experiment->worked += std::min(elapsed, kLongest);
  }
}

}  // namespace legopt::server
