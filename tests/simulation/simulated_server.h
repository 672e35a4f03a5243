#pragma once

#include <memory>

#include "server/server.h"
#include "tests/simulation/disk.h"
#include "tests/simulation/faulty_store.h"
#include "tests/simulation/process.h"
#include "tests/simulation/record.h"

namespace legopt::simulation {

/// Returns the time constants of the simulated service: a tenth to a third of the defaults, so that many leases end
/// within a short history.
server::SchedulerOptions QuickTimes();

/// The real Server over a bus endpoint and a store, as a process that can die.
class SimulatedServer final : public Process {
 public:
  /// All arguments must outlive it.
  SimulatedServer(World& world, Disk& disk, Record& record, server::SchedulerOptions options);
  ~SimulatedServer() override;

  DiskFaults& faults() { return faults_; }
  /// Moves its wall clock.
  void StepWallClock(microseconds by) { wall_clock_us_ += by.count(); }
  /// Returns null while it is down.
  const server::Server* server() const { return server_.get(); }
  Disk& disk() { return disk_; }

 private:
  bool Start() override;
  void Turn() override;
  microseconds next_turn() const override;
  void DestroyObjects() override;
  void CheckAccounts();

  Disk& disk_;
  Record& record_;
  server::SchedulerOptions options_;
  DiskFaults faults_;
  std::int64_t wall_clock_us_ = 1'700'000'000'000'000;
  std::unique_ptr<FaultyStore> store_;
  std::unique_ptr<bus::Endpoint> endpoint_;
  std::unique_ptr<server::Server> server_;
  microseconds next_accounts_{0};
};

}  // namespace legopt::simulation
