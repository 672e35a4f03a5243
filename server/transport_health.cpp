#include "server/transport_health.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "legopt/input/json.h"

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

}  // namespace legopt::server
