#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "bus/endpoint.h"
#include "db/store.h"
#include "server/server.h"
#include "tests/doubles/simulated_network.h"
#include "tests/simulation/fleet_worker.h"

namespace legopt::simulation {

struct FleetOptions {
  int workers = 500;
  int slots = 1;  ///< slots of each worker
  std::int64_t jobs = 1'000'000;
  int experiments = 1;                       ///< divide the jobs evenly; a divisor of `jobs`
  microseconds job_time{250'000};            ///< mean; each job takes between 3/4 and 5/4 of it
  microseconds network_delay{200};           ///< minimum delay of each datagram; time advances in turns of kFleetTurn
  std::chrono::seconds longest_time{3'600};  ///< limit of virtual time
  bool keyed = false;                        ///< the deployment has a key
  /// Datagrams that may wait for a party; more are lost. The server needs this time for each (0: none).
  std::size_t receive_buffer = SIZE_MAX;
  microseconds time_per_datagram{0};
};

inline constexpr microseconds kFleetTurn{1'000};

/// One real Server and many real worker pools on a simulated network in virtual time, without faults: the work of a
/// server for a large fleet, and its cost. Only the job processes are simulated.
///
/// Thread safety: one thread.
class Fleet {
 public:
  /// `store` must outlive it.
  Fleet(const FleetOptions& options, db::Store& store);

  /// Submits the experiments over the network, then runs until every job is over or longest_time has passed. Calls
  /// `look` after every hundredth of the jobs. Returns whether all are over.
  bool Run(const std::function<void()>& look);

  /// Runs until every worker is registered, or `limit` has passed. Returns whether all are.
  bool RunUntilRegistered(microseconds limit);
  void RunFor(microseconds duration);
  /// Kills the server with its waiting datagrams. Until it is started again there are no answers.
  void StopServer();
  /// Starts a new server process on the same store.
  void StartServer();

  std::int64_t jobs_done() const;
  const server::Scheduler& scheduler() const { return server_->scheduler(); }
  microseconds now() const { return network_.now(); }
  /// Returns the counters of the endpoint of the current server process.
  const bus::Counters& server_counters() const { return server_endpoint_->counters(); }
  /// Returns the virtual time since the last experiment was accepted.
  microseconds elapsed() const { return network_.now() - accepted_at_; }
  /// Returns the CPU time of the server's work since then: receiving, scheduling, storing, sending.
  std::chrono::nanoseconds server_cpu() const { return server_cpu_; }
  /// Returns the fraction of the slots' time in which they had a job, since the first job ended.
  double busy_share() const;
  std::size_t spec_bytes() const { return spec_bytes_; }  ///< size of one submission

 private:
  bool AllRegistered() const;
  void Submit();
  void Step();
  void ServerTurn();

  FleetOptions options_;
  db::Store& store_;
  std::shared_ptr<const bus::MessageKey> key_;
  bus::SimulatedNetwork network_;
  std::int64_t lives_ = 0;  // number of server processes so far
  std::optional<bus::SimulatedTransport> server_transport_;
  std::optional<bus::Endpoint> server_endpoint_;
  std::unique_ptr<server::Server> server_;
  bus::SimulatedTransport client_transport_;
  bus::Endpoint client_;
  std::vector<std::unique_ptr<FleetWorker>> workers_;
  std::int64_t tokens_ = 0;
  int accepted_ = 0;  // number of experiments
  microseconds accepted_at_{0};
  std::chrono::nanoseconds server_cpu_{0};
  std::size_t spec_bytes_ = 0;
};

}  // namespace legopt::simulation
