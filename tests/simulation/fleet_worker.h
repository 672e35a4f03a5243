#pragma once

#include <memory>
#include <random>
#include <vector>

#include "bus/endpoint.h"
#include "tests/doubles/simulated_network.h"
#include "worker/pool.h"
#include "worker/server_link.h"

namespace legopt::simulation {

using std::chrono::microseconds;

inline constexpr std::int64_t kFleetDeployment = 1;

/// The real Pool with its calls and simulated job processes: they are ready at once, never fail, and end each job
/// after its time. Cheaper than SimulatedWorker and without a record, so that there can be hundreds.
class FleetWorker {
 public:
  FleetWorker(bus::SimulatedNetwork& network, std::shared_ptr<const bus::MessageKey> key, int number, int slots,
              microseconds job_time);

  bool due(microseconds now) const;
  void Turn(microseconds now);
  /// Returns the time that its slots have spent on finished jobs.
  microseconds busy() const { return busy_; }

 private:
  struct Slot {
    std::uint64_t sequence = 0;  // sequence number of its job, 0: none
    legopt_msg::lease lease;
    microseconds begun{0}, ends{0};
  };

  void EndJobs(microseconds now);
  void CarryOutActions(microseconds now);
  void CarryOut(microseconds now, const worker::StartChild& action);
  void CarryOut(microseconds now, const worker::AssignJob& action);
  void CarryOut(microseconds, const worker::CancelJob&) {}
  void CarryOut(microseconds, const worker::KillChild&) {}
  void CarryOut(microseconds, const worker::LogLine&) {}
  void CarryOut(microseconds, const worker::ExitWorker&) {}
  template <class Call>
  void CarryOut(microseconds, const Call& action) {
    calls_.CarryOut(action);
  }

  bus::SimulatedTransport transport_;
  bus::Endpoint endpoint_;
  worker::EndpointLink link_;
  worker::Pool pool_;
  worker::PoolCalls calls_;
  std::vector<Slot> slots_;
  std::vector<int> starting_;
  std::mt19937_64 random_;
  microseconds job_time_;
  microseconds busy_{0};
  microseconds next_turn_{0};
};

}  // namespace legopt::simulation
