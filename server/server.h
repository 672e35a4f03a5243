#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bus/endpoint.h"
#include "db/store.h"
#include "legopt_msg/dataset_reply.hpp"
#include "legopt_msg/dataset_request.hpp"
#include "legopt_msg/store_dataset_reply.hpp"
#include "legopt_msg/store_dataset_request.hpp"
#include "server/event_monitors.h"
#include "server/query_service.h"
#include "server/scheduler.h"

namespace legopt::server {

struct ServerOptions {
  SchedulerOptions scheduler;
  std::string version;                   ///< version of this release
  std::string hostname;                  ///< shown to users
  std::int64_t pid = 0;                  ///< shown to users
  std::string database;                  ///< absolute path, for display
  microseconds commit_interval{10'000};  ///< time between commits, unless commit_batch replies wait for one
  std::size_t commit_batch = 64;
  microseconds place_check{1'000'000};      ///< interval of the check that the database is still at its path
  microseconds idle_checkpoint{1'000'000};  ///< idle time after which the store may checkpoint
  microseconds first_store_retry{50'000};   ///< delay after a transient store error; doubles up to max_store_retry
  microseconds max_store_retry{2'000'000};
  /// Returns the archive of the dataset with this content hash; nullptr if missing. Valid until the next call. Empty:
  /// none. Archives in the store are offered as well.
  std::function<const std::string*(const std::string& hash)> find_dataset = {};
  /// Called with each event when it is on disk, in order. Must not block. May be empty.
  std::function<void(const db::RecordEvent&)> on_event = {};
  MonitorLimits conditions;                      ///< thresholds for events
  std::function<microseconds()> stopwatch = {};  ///< steady time for measuring commits; empty: all durations are 0
  ConditionMonitor::DiskSpace disk_space = {};   ///< disk of the database; empty: not monitored
  bool store_datasets = true;  ///< store datasets (from find_dataset or sent by clients) once an experiment uses them
  /// Total size of all stored datasets above which datasets from clients are no longer stored.
  std::int64_t most_dataset_bytes = std::int64_t{1} << 30;
  std::size_t max_deferred = 4096;  ///< requests kept while the store fails; further ones stay unanswered, and their
                                    ///< callers retry
  std::size_t max_deferred_bytes = std::size_t{64} << 20;  ///< total size of these requests
};

/// Runs the scheduler on the bus with a store: receives messages, commits one transaction per round, then sends
/// replies.
///
/// A round handles the received messages, applies all operations in one commit, and only then sends the replies, so
/// everything that a caller learns is on disk. A busy server combines rounds into one commit: it waits until
/// commit_interval has passed since the last commit or commit_batch replies depend on it. An idle server commits
/// immediately. While the store reports a full disk, an I/O error, a lock or a displaced file (in writes, reads or the
/// check about once a second), the same transaction is retried. Meanwhile nothing is acknowledged or leased;
/// heartbeats, status and queries are answered, and other requests wait. Round throws other store errors.
///
/// Thread rule: the endpoint's thread.
class Server {
 public:
  using WallClock = std::function<std::int64_t()>;  ///< microseconds since 1970

  /// All references must outlive the server; `queries` may be null (then SQL is refused). Loads the open state of the
  /// store. Throws StoreError, SpecError.
  Server(bus::Endpoint& endpoint, db::Store& store, QueryService* queries, ServerOptions options, WallClock wall_clock,
         Scheduler::TokenSource tokens);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Polls for at most `max_wait` (less if a deadline is earlier) and does all due work. Events on the `extra`
  /// descriptors end the wait; their revents are set.
  void Round(microseconds max_wait, std::span<const pollfd> extra = {});
  /// Does the work of a round after polling; for drivers that poll the endpoint themselves (simulations).
  void Work();
  /// Returns how long such a driver may wait for messages before it must call Work; at most `max_wait`.
  microseconds WaitTime(microseconds max_wait) const;
  /// True if no operations wait for a commit: scheduler and store agree.
  bool settled() const { return ops_.empty(); }

  /// True if a client requested the shutdown of the server.
  bool shutdown_requested() const { return shutdown_requested_; }
  /// Stops leasing jobs, informs the workers, and records the shutdown as an event; committed by the next round.
  void Drain();
  /// Re-queues all running jobs without waiting until their leases expire; committed by the next round. For a server
  /// whose workers have ended before it.
  void RequeueRunningJobs(const std::string& why);

  bool store_healthy() const { return store_error_.empty(); }
  const Scheduler& scheduler() const { return scheduler_; }

 private:
  struct Pending {
    bus::Responder responder;
    std::string body;
  };
  struct Deferred {
    std::function<void()> handle;
    bus::Responder responder;
    std::size_t bytes = 0;  ///< size of the request
  };

  void RegisterHandlers();
  /// Registers a handler that decodes the message. While the store fails, the request is deferred unless `always` is
  /// set.
  template <class Message, class Handler>
  void Serve(bus::MessageType type, bool always, Handler handler);
  void ServeProbe();
  /// Stores the datasets of experiments that are created by the operations starting at index `first`.
  void StoreDatasets(std::size_t first);
  void TakeDataset(const legopt_msg::store_dataset_request& request, bus::Responder responder);
  /// Returns why the archive of this dataset cannot be stored; empty if it can. Reads the store.
  std::string ReasonNotToStore(const db::ArchiveFacts& facts, std::size_t bytes) const;
  /// Returns the archive of a dataset, from the operator's folder or the store; nullptr if missing. Valid until the
  /// next call.
  const std::string* FindArchive(const std::string& hash);
  bool OffersDataset(const std::string& hash);
  legopt_msg::dataset_reply ReadDatasetChunk(const legopt_msg::dataset_request& request);
  void ServeQuery();
  void ServeLease();
  void ServeStatus();
  void Later(bus::Responder responder, std::string body);  ///< replies after the commit
  void FinishQueries();
  void CommitRound();
  bool CommitDue() const;
  /// Called before an answer about the state: the answer and queries see exactly the committed state, with all received
  /// changes.
  void CommitNow();
  void Commit();
  void CheckPlace();
  void StoreFailed(const db::StoreError& error);
  void PublishEvents() const;
  void OfferStoredDatasets();
  nlohmann::json Figures() const;
  nlohmann::json RequestsJson() const;
  TransportHealth::Listing Counters() const;
  void ResumeDeferred();
  microseconds Stopwatch() const;
  Instant Now() const;

  bus::Endpoint& endpoint_;
  db::Store& store_;
  QueryService* queries_;
  ServerOptions options_;
  WallClock wall_clock_;
  Scheduler scheduler_;
  microseconds started_;

  struct Archive {
    std::string hash, bytes;
  } archive_;  ///< last archive read from the store
  Scheduler::Ops ops_;
  TransportHealth health_;
  std::size_t watched_ops_ = 0;  ///< number of elements of ops_ seen by health_
  std::vector<Pending> replies_;
  std::string store_error_;  ///< empty: no error
  microseconds store_retry_at_{0}, store_retry_after_{0};
  struct RequestCount {
    std::uint64_t requests = 0;
    std::uint64_t bytes = 0;  ///< size of the bodies
  };
  std::array<RequestCount, bus::kLastMessageType + 1> requests_{};  ///< received requests; index: message type
  std::deque<Deferred> deferred_;
  std::size_t deferred_bytes_ = 0;
  microseconds last_commit_{0};
  struct Commits {
    std::uint64_t count = 0;
    microseconds total{0}, longest{0};
  } commits_;
  ConditionMonitor watch_;
  microseconds next_place_check_{0};
  bool tidy_ = true;
  std::map<std::int64_t, bus::Responder> open_queries_;
  std::int64_t next_query_ = 1;
  bool shutdown_requested_ = false;
  bool draining_ = false;
};

/// Returns the answer to a probe of a server with these options.
legopt_msg::probe_reply ProbeReply(const ServerOptions& options, microseconds uptime, std::int64_t wall_clock_us);

}  // namespace legopt::server
