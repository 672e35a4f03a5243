#pragma once

#include <memory>
#include <vector>

#include "tests/simulation/simulated_client.h"
#include "tests/simulation/simulated_server.h"
#include "tests/simulation/simulated_worker.h"
#include "tests/simulation/world.h"

namespace legopt::simulation {

/// The objects that faults are injected into.
struct FaultTargets {
  SimulatedServer& server;
  std::vector<std::unique_ptr<SimulatedWorker>>& workers;
  std::vector<std::unique_ptr<SimulatedClient>>& clients;
};

/// Injects random faults: lost, repeated, late, truncated and altered datagrams; processes that are killed (at once or
/// in the middle of their work), paused, stopped and disconnected; wall clocks that jump; full or failing disks.
///
/// Each history has its own selection of faults and its own rate, so that rare combinations occur. All arguments must
/// outlive it.
class Nemesis {
 public:
  Nemesis(World& world, FaultTargets cast);
  /// Injects faults from now until `end`, then repairs everything.
  void Strike(microseconds end);

 private:
  enum class Blow {
    kKillServer,
    kKillServerSoon,
    kKillWorker,
    kKillWorkerSoon,
    kKillClient,
    kPauseServer,
    kPauseWorker,
    kPauseClient,
    kPartition,
    kStopWorker,
    kDiskFull,
    kDiskFails,
    kReadingFails,
    kStepWallClock,
  };
  static constexpr std::uint64_t kNumFaultKinds = 14;

  void ChooseNetworkFaults();
  void Next();
  void InjectNext(Blow blow);
  void LandOnServer(Blow blow);
  void Heal();
  microseconds Outage();
  SimulatedWorker& AnyWorker() { return *fault_targets_.workers[world_.Below(fault_targets_.workers.size())]; }
  SimulatedClient& AnyClient() { return *fault_targets_.clients[world_.Below(fault_targets_.clients.size())]; }

  World& world_;
  FaultTargets fault_targets_;
  std::vector<Blow> chosen_;
  microseconds pace_;
  microseconds end_{0};
};

}  // namespace legopt::simulation
