#pragma once

#include <memory>
#include <vector>

#include "tests/simulation/simulated_client.h"
#include "tests/simulation/simulated_server.h"
#include "tests/simulation/simulated_worker.h"
#include "tests/simulation/world.h"

namespace legopt::simulation {

/// The objects that faults are injected into.
struct Cast {
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
  Nemesis(World& world, Cast cast);
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
  static constexpr std::uint64_t kNumBlows = 14;

  void ChooseWeather();
  void Next();
  void Land(Blow blow);
  void LandOnServer(Blow blow);
  void Heal();
  microseconds Outage();
  SimulatedWorker& AnyWorker() { return *cast_.workers[world_.Below(cast_.workers.size())]; }
  SimulatedClient& AnyClient() { return *cast_.clients[world_.Below(cast_.clients.size())]; }

  World& world_;
  Cast cast_;
  std::vector<Blow> chosen_;
  microseconds pace_;
  microseconds end_{0};
};

}  // namespace legopt::simulation
