#include "server/estimate.h"

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

}  // namespace legopt::server
