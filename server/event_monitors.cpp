#include "server/event_monitors.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "legopt/input/json.h"
#include "server/forecast.h"

namespace legopt::server {
namespace {

// Returns the experiment that this operation ends; 0 if none.
std::int64_t EndedBy(const db::StoreOp& op) {
  if (const auto* finish = std::get_if<db::FinishExperiment>(&op)) return finish->experiment_id;
  if (const auto* cancel = std::get_if<db::CancelExperiment>(&op)) return cancel->experiment_id;
  return 0;
}

// Returns the experiment that this operation opens; 0 if none.
std::int64_t BegunBy(const db::StoreOp& op) {
  if (const auto* create = std::get_if<db::CreateExperiment>(&op)) return create->experiment.experiment_id;
  if (const auto* retry = std::get_if<db::RetryExperiment>(&op)) return retry->experiment_id;
  return 0;
}

}  // namespace

void TransportHealth::Begin(std::int64_t experiment_id, const Listing& counters) {
  auto& values = at_begin_[experiment_id];
  for (const auto& [name, value] : counters) values[std::string(name)] = value;
}

void TransportHealth::Watch(std::size_t first, const std::function<Listing()>& counters, std::int64_t wall_us,
                            std::vector<db::StoreOp>& ops) {
  const std::size_t last = ops.size();
  for (std::size_t i = first; i < last; ++i) {
    if (const std::int64_t begun = BegunBy(ops[i]); begun != 0) Begin(begun, counters());
    const std::int64_t ended = EndedBy(ops[i]);
    if (ended == 0) continue;
    ops.emplace_back(db::RecordEvent{"transport_health", wall_us, ended, {}, {}, GrowthOf(ended, counters())});
    at_begin_.erase(ended);
  }
}

std::string TransportHealth::GrowthOf(std::int64_t experiment_id, const Listing& counters) const {
  nlohmann::json growth = nlohmann::json::object();
  const auto begin = at_begin_.find(experiment_id);
  for (const auto& [name, value] : counters) {
    const std::string key(name);
    const std::uint64_t before = begin == at_begin_.end() || !begin->second.contains(key) ? 0 : begin->second.at(key);
    if (value > before) growth[key] = value - before;
  }
  return Dump(growth);
}

namespace {

constexpr std::int64_t kBytesPerMegabyte = 1'000'000;
constexpr double kPercent = 100;

std::string TextOf(const db::DiskSpace& disk) {
  const double share = static_cast<double>(disk.free_bytes) / static_cast<double>(disk.total_bytes);
  return std::to_string(disk.free_bytes / kBytesPerMegabyte) + " of " +
         std::to_string(disk.total_bytes / kBytesPerMegabyte) + " MB free (" +
         std::to_string(std::lround(kPercent * share)) +
         " %) where the database is; when it is full nothing is leased until space is freed";
}

}  // namespace

void ConditionMonitor::Look(const Scheduler& scheduler, const Instant& now, const std::string& store_error,
                            Scheduler::Ops& ops) {
  if (now.steady < next_look_) return;
  next_look_ = now.steady + limits_.interval;
  CheckDiskSpace(now, ops);
  CheckForStalls(scheduler, now, store_error, ops);
}

// A low disk stays low until clearly more space is free, so that it is reported only once.
void ConditionMonitor::CheckDiskSpace(const Instant& now, Scheduler::Ops& ops) {
  constexpr double kRecovery = 1.2;
  if (disk_space_) disk_ = disk_space_();
  if (!disk_ || disk_->total_bytes <= 0) return;
  const double factor = disk_low_ ? kRecovery : 1.0;
  const bool low =
      static_cast<double>(disk_->free_bytes) < factor * limits_.low_share * static_cast<double>(disk_->total_bytes) &&
      static_cast<double>(disk_->free_bytes) < factor * static_cast<double>(limits_.low_bytes);
  if (low && !disk_low_) ops.emplace_back(db::RecordEvent{"disk_low", now.wall_us, {}, {}, {}, TextOf(*disk_)});
  disk_low_ = low;
}

void ConditionMonitor::CheckForStalls(const Scheduler& scheduler, const Instant& now, const std::string& store_error,
                                      Scheduler::Ops& ops) {
  std::map<std::int64_t, microseconds> still;
  std::optional<ForecastSnapshot>
      outlooks;  // expensive (visits every lease), so created only if an experiment is active
  for (const auto& [id, summary] : scheduler.experiments()) {
    if (summary.state != db::ExperimentState::kActive || summary.control.hold != db::ExperimentHold::kNone) continue;
    if (!outlooks) outlooks.emplace(scheduler, now, store_error);
    const std::string reason = outlooks->StallReason(id);
    if (reason.empty()) continue;
    const auto before = still_since_.find(id);
    const microseconds since = before == still_since_.end() ? now.steady : before->second;
    still[id] = since;
    if (now.steady - since >= limits_.standstill && reported_.insert(id).second) {
      ops.emplace_back(db::RecordEvent{"no_progress", now.wall_us, id, {}, {}, reason});
    }
  }
  std::erase_if(reported_, [&still](std::int64_t id) { return !still.contains(id); });
  still_since_ = std::move(still);
}

}  // namespace legopt::server
