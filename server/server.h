#pragma once

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
#include "server/condition_watch.h"
#include "server/query_service.h"
#include "server/scheduler.h"
#include "server/transport_health.h"

namespace legopt::server {

struct ServerOptions {
  SchedulerOptions scheduler;
  std::string version;                   ///< of this release
  std::string hostname;                  ///< for humans
  std::int64_t pid = 0;                  ///< for humans
  std::string database;                  ///< absolute path, for humans
  microseconds commit_interval{10'000};  ///< between commits, unless commit_batch replies wait for one
  std::size_t commit_batch = 64;
  microseconds place_check{1'000'000};      ///< between looks whether the database is where it was opened
  microseconds idle_checkpoint{1'000'000};  ///< quiet time after which the store may tidy up
  microseconds first_store_retry{50'000};   ///< after a transient store error; doubles up to max_store_retry
  microseconds max_store_retry{2'000'000};
  /// Archive of the dataset with this content hash; null: not there. Valid until the next call. Empty: none is. The
  /// store's archives are handed out as well.
  std::function<const std::string*(const std::string& hash)> find_dataset = {};
  /// Each event when it is on disk, in order. Must not wait. Empty: nobody listens.
  std::function<void(const db::RecordEvent&)> on_event = {};
  ConditionLimits conditions;                    ///< limits beyond which events are recorded
  std::function<microseconds()> stopwatch = {};  ///< steady time that commits are measured with; empty: they take 0
  ConditionWatch::DiskSpace disk_space = {};     ///< where the database is; empty: not watched
  bool store_datasets = true;  ///< those that find_dataset has or clients send, once an experiment was made on them
  /// Size of all stored datasets from which on none of a client is stored any more.
  std::int64_t most_dataset_bytes = std::int64_t{1} << 30;
  std::size_t max_deferred = 4096;  ///< requests kept while the store fails; more are left to their callers
  std::size_t max_deferred_bytes = std::size_t{64} << 20;  ///< bodies of these requests
};

/// The scheduler on the bus, over a store: messages in, one transaction per round, then the replies.
///
/// A round takes what has arrived, applies all its operations in one commit, and only then sends the replies: whatever
/// a caller is told is on disk. A busy server groups rounds into one commit: it waits until commit_interval has passed
/// since the last one or commit_batch replies depend on it. What arrives at an idle server is committed at once. While
/// the store reports a full disk, an I/O error, a lock or a file that is not at its path any more, in writing, reading
/// or when it is asked about once a second, the same transaction is tried again and again; nothing is acknowledged or
/// leased, heartbeats, status and queries are answered, and other requests wait. Other store errors end Round with that
/// StoreError.
///
/// Thread rule: the endpoint's thread.
class Server {
 public:
  using WallClock = std::function<std::int64_t()>;  ///< microseconds since 1970

  /// Everything must outlive the server; `queries` may be null (then SQL is refused). Loads the store's open state.
  /// Throws StoreError, SpecError.
  Server(bus::Endpoint& endpoint, db::Store& store, QueryService* queries, ServerOptions options, WallClock wall_clock,
         Scheduler::TokenSource tokens);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Polls for at most `max_wait` (less when something is due) and does all that is to do. `extra` descriptors wake it
  /// up; their revents are filled in.
  void Round(microseconds max_wait, std::span<const pollfd> extra = {});
  /// The part of a round after polling; for drivers that poll the endpoint themselves (simulations).
  void Work();
  /// How long such a driver may wait before Work has something to do although nothing arrives; at most `max_wait`.
  microseconds WaitTime(microseconds max_wait) const;
  /// Nothing waits for a commit: the scheduler and the store agree.
  bool settled() const { return ops_.empty(); }

  /// A client asked for the end of the server.
  bool shutdown_requested() const { return shutdown_requested_; }
  /// Leases no more jobs, tells workers so, and notes the end in the events; committed by the next round.
  void Drain();
  /// Queues all running jobs again, without waiting until their leases expire; committed by the next round. For a
  /// server whose workers have ended before it.
  void GiveBackRunningJobs(const std::string& why);

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
  /// Registers a handler that decodes, and that is put off while the store fails unless `always` is set.
  template <class Message, class Handler>
  void Serve(bus::MessageType type, bool always, Handler handler);
  void ServeProbe();
  /// Stores the datasets of the experiments that the operations from `first` on create.
  void StoreDatasets(std::size_t first);
  void TakeDataset(const legopt_msg::store_dataset_request& request, bus::Responder responder);
  /// Why the archive of this dataset is not stored; empty: it may be. Reads the store.
  std::string ObstacleToStoring(const db::ArchiveFacts& facts, std::size_t bytes) const;
  /// The archive of a dataset, from the operator's folder or the store; null: none. Valid until the next call.
  const std::string* FindArchive(const std::string& hash);
  bool HandsOut(const std::string& hash);
  legopt_msg::dataset_reply PieceOfDataset(const legopt_msg::dataset_request& request);
  void ServeQuery();
  void ServeLease();
  void ServeStatus();
  void Later(bus::Responder responder, std::string body);  ///< reply after the commit
  void FinishQueries();
  void CommitRound();
  bool CommitDue() const;
  /// Before an answer about the state: it tells, and a query sees, nothing but what is on disk and all that is known.
  void CommitNow();
  void Commit();
  void CheckPlace();
  void StoreFailed(const db::StoreError& error);
  void PublishEvents() const;
  void OfferStoredDatasets();
  nlohmann::json Figures() const;
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
  } archive_;  ///< the last one that was read from the store
  Scheduler::Ops ops_;
  TransportHealth health_;
  std::size_t watched_ops_ = 0;  ///< of ops_, seen by health_
  std::vector<Pending> replies_;
  std::string store_error_;  ///< empty: healthy
  microseconds store_retry_at_{0}, store_retry_after_{0};
  std::deque<Deferred> deferred_;
  std::size_t deferred_bytes_ = 0;
  microseconds last_commit_{0};
  struct Commits {
    std::uint64_t count = 0;
    microseconds total{0}, longest{0};
  } commits_;
  ConditionWatch watch_;
  microseconds next_place_check_{0};
  bool tidy_ = true;
  std::map<std::int64_t, bus::Responder> open_queries_;
  std::int64_t next_query_ = 1;
  bool shutdown_requested_ = false;
  bool draining_ = false;
};

/// What a server with these options answers to a probe.
legopt_msg::probe_reply ProbeReply(const ServerOptions& options, microseconds uptime, std::int64_t wall_clock_us);

}  // namespace legopt::server
