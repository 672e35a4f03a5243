#include "tests/simulation/fleet_worker.h"

#include <algorithm>
#include <string>
#include <utility>

#include "bus/messages.h"
#include "worker/job_executor.h"

namespace legopt::simulation {
namespace {

constexpr std::int64_t kFirstAddress = std::int64_t{1} << 32U;
constexpr int kNumbers = 36;  // numbers of a posture

worker::PoolOptions OptionsOf(int number, int slots) {
  worker::PoolOptions options;
  options.slots = slots;
  options.name = "worker " + std::to_string(number);
  options.pid = 1;
  options.protocol_version = bus::kProtocolVersion;
  options.build_id = "simulated";
  options.seed = static_cast<std::uint64_t>(number) + 1;
  return options;
}

legopt_msg::result_request Success(const legopt_msg::lease& lease, microseconds wall) {
  legopt_msg::result_request result = worker::ResultWithoutSolution(ReportedOutcome::kFinished, "");
  result.solver_status = "converged_feasible";
  result.iterations = 17;
  result.wall_us = wall.count();
  result.cpu_us = wall.count();
  result.verdict_literal = "success";
  result.verdict_strict = "success";
  result.verdict_solid = result.verdict_physical = "success";
  result.cost = static_cast<double>(lease.job_id);
  result.num_waypoints = 1;
  result.waypoint_size = kNumbers;
  result.num_values = kNumbers;
  result.waypoints.assign(kNumbers, 0.25);
  return result;
}

}  // namespace

FleetWorker::FleetWorker(bus::SimulatedNetwork& network, std::shared_ptr<const bus::MessageKey> key, int number,
                         int slots, microseconds job_time)
    : transport_(network, kFleetDeployment, std::move(key)),
      endpoint_(transport_, kFirstAddress + number, static_cast<std::uint64_t>(number) + 1),
      link_(endpoint_),
      pool_(OptionsOf(number, slots), network.now()),
      calls_(link_, pool_),
      slots_(static_cast<std::size_t>(slots)),
      random_(static_cast<std::uint64_t>(number) + 1),
      job_time_(job_time) {}

bool FleetWorker::due(microseconds now) const {
  const auto arrival = transport_.next_arrival();
  return next_turn_ <= now || (arrival && *arrival <= now);
}

void FleetWorker::Turn(microseconds now) {
  endpoint_.Poll(microseconds(0));
  for (const int slot : std::exchange(starting_, {})) {
    pool_.OnChildReady(now, slot, {{"garage", std::string(64, 'd')}});
  }
  EndJobs(now);
  pool_.Tick(now);
  CarryOutActions(now);
  next_turn_ = std::min(pool_.next_deadline(), endpoint_.next_timer().value_or(microseconds::max()));
  for (const Slot& slot : slots_) {
    if (slot.sequence != 0) next_turn_ = std::min(next_turn_, slot.ends);
  }
  if (!starting_.empty()) next_turn_ = now;
}

void FleetWorker::EndJobs(microseconds now) {
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    Slot& slot = slots_[i];
    if (slot.sequence == 0 || now < slot.ends) continue;
    busy_ += now - slot.begun;
    pool_.OnChildResult(now, static_cast<int>(i), std::exchange(slot.sequence, 0),
                        Success(slot.lease, now - slot.begun));
  }
}

void FleetWorker::CarryOutActions(microseconds now) {
  for (auto actions = pool_.TakeActions(); !actions.empty(); actions = pool_.TakeActions()) {
    for (const worker::Action& action : actions) {
      std::visit([&](const auto& specific) { CarryOut(now, specific); }, action);
    }
  }
}

void FleetWorker::CarryOut(microseconds /*now*/, const worker::StartChild& action) { starting_.push_back(action.slot); }

void FleetWorker::CarryOut(microseconds now, const worker::AssignJob& action) {
  const std::int64_t quarter = job_time_.count() / 4;
  const auto extra = static_cast<std::int64_t>(random_() % static_cast<std::uint64_t>(2 * quarter + 1));
  slots_[static_cast<std::size_t>(action.slot)] = {action.sequence, action.lease, now,
                                                   now + microseconds(3 * quarter + extra)};
}

}  // namespace legopt::simulation
