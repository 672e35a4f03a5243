#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "bus/endpoint.h"
#include "bus/simulated_network.h"
#include "db/store.h"
#include "server/server.h"
#include "tests/simulation/fleet_worker.h"

namespace legopt::simulation {

struct FleetOptions {
  int workers = 500;
  int slots = 1;  ///< of each worker
  std::int64_t jobs = 1'000'000;
  int experiments = 1;                       ///< among which the jobs are divided; a divisor of `jobs`
  microseconds job_time{250'000};            ///< mean; each job takes between three and five quarters of it
  microseconds network_delay{200};           ///< of each datagram, at least; time moves in turns of kFleetTurn
  std::chrono::seconds longest_time{3'600};  ///< of virtual time
  bool keyed = false;                        ///< the deployment has a key
  /// Datagrams that may wait for a party; more are lost. The server takes this time for each (0: none).
  std::size_t receive_buffer = SIZE_MAX;
  microseconds time_per_datagram{0};
};

inline constexpr microseconds kFleetTurn{1'000};

/// One real Server and many real worker pools on a simulated network in virtual time, without misfortune: what a server
/// does for a large fleet, and what it costs. Only the job processes are played.
///
/// Thread rule: one thread.
class Fleet {
 public:
  /// `store` must outlive it.
  Fleet(const FleetOptions& options, db::Store& store);

  /// Submits the experiments over the network, then runs until every job is over or longest_time has passed.
  /// `look` is called after every hundredth of the jobs. Returns whether all are over.
  bool Run(const std::function<void()>& look);

  /// Runs until the server knows every worker, or `limit` has passed. Returns whether it does.
  bool RunUntilRegistered(microseconds limit);
  void RunFor(microseconds duration);
  /// The server dies, with what waits for it. Until it is started again nobody answers.
  void StopServer();
  /// Another life of it, on the same store.
  void StartServer();

  std::int64_t jobs_done() const;
  const server::Scheduler& scheduler() const { return server_->scheduler(); }
  microseconds now() const { return network_.now(); }
  /// Of the server's endpoint, in its present life.
  const bus::Counters& server_counters() const { return server_endpoint_->counters(); }
  /// Virtual time since the last experiment was accepted.
  microseconds elapsed() const { return network_.now() - accepted_at_; }
  /// CPU time of the server's part of the work since then: receiving, deciding, storing, sending.
  std::chrono::nanoseconds server_cpu() const { return server_cpu_; }
  /// Share of the slots' time in which they had a job, since the first job ended.
  double busy_share() const;
  std::size_t spec_bytes() const { return spec_bytes_; }  ///< of one submission

 private:
  bool AllRegistered() const;
  void Submit();
  void Step();
  void ServerTurn();

  FleetOptions options_;
  db::Store& store_;
  std::shared_ptr<const bus::MessageKey> key_;
  bus::SimulatedNetwork network_;
  std::int64_t lives_ = 0;  // of the server
  std::optional<bus::SimulatedTransport> server_transport_;
  std::optional<bus::Endpoint> server_endpoint_;
  std::unique_ptr<server::Server> server_;
  bus::SimulatedTransport client_transport_;
  bus::Endpoint client_;
  std::vector<std::unique_ptr<FleetWorker>> workers_;
  std::int64_t tokens_ = 0;
  int accepted_ = 0;  // experiments
  microseconds accepted_at_{0};
  std::chrono::nanoseconds server_cpu_{0};
  std::size_t spec_bytes_ = 0;
};

}  // namespace legopt::simulation
