#pragma once

#include <memory>
#include <vector>

#include "tests/simulation/simulated_client.h"
#include "tests/simulation/simulated_server.h"
#include "tests/simulation/simulated_worker.h"
#include "tests/simulation/world.h"

namespace legopt::simulation {

/// What can be hurt.
struct Cast {
  SimulatedServer& server;
  std::vector<std::unique_ptr<SimulatedWorker>>& workers;
  std::vector<std::unique_ptr<SimulatedClient>>& clients;
};

/// Brings misfortune by the world's dice: lost, repeated, late, cut and altered datagrams; processes killed (at once,
/// or in the middle of what they do), paused, stopped and cut off; wall clocks that jump; disks that are full or fail.
///
/// Each history has its own selection and its own pace, so that rare combinations come up. All must outlive it.
class Nemesis {
 public:
  Nemesis(World& world, Cast cast);
  /// Strikes from now until `end`, then heals everything that it has hurt.
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
