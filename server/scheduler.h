#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bus/transport.h"
#include "db/file_system.h"
#include "db/store.h"
#include "legopt_msg/cancel_reply.hpp"
#include "legopt_msg/cancel_request.hpp"
#include "legopt_msg/control_reply.hpp"
#include "legopt_msg/control_request.hpp"
#include "legopt_msg/heartbeat_reply.hpp"
#include "legopt_msg/heartbeat_request.hpp"
#include "legopt_msg/hello_reply.hpp"
#include "legopt_msg/hello_request.hpp"
#include "legopt_msg/lease_reply.hpp"
#include "legopt_msg/lease_request.hpp"
#include "legopt_msg/result_reply.hpp"
#include "legopt_msg/result_request.hpp"
#include "legopt_msg/submit_reply.hpp"
#include "legopt_msg/submit_request.hpp"
#include "server/budget.h"
#include "server/capability.h"
#include "server/experiment.h"
#include "server/fair_share.h"
#include "server/rate_limit.h"

namespace legopt::server {

using std::chrono::microseconds;

/// The moment at which a message is handled. Only `steady` decides anything; `wall_us` (microseconds since 1970) is
/// written beside rows for people and may jump.
struct Instant {
  microseconds steady{0};
  std::int64_t wall_us = 0;
};

struct SchedulerOptions {
  std::int64_t server_instance = 0;            ///< random, of this server process
  microseconds lease{10'000'000};              ///< renewed by every heartbeat that lists it
  microseconds grace{1'500'000};               ///< waited beyond the lease: the worker stops itself first
  microseconds heartbeat{500'000};             ///< asked of workers; a cancelled job runs on for as long
  microseconds expiry_scan{100'000};           ///< how often Tick looks for expired leases
  microseconds sighting{60'000'000};           ///< between writes of a living worker's last sighting
  microseconds retention{60'000'000};          ///< closed experiments stay in memory for late messages
  microseconds min_retry{50'000};              ///< told to a worker for which there is no job now
  microseconds retry_per_worker{2'000};        ///< times the number of workers: bounds the rate of idle requests
  microseconds offline_shown{86'400'000'000};  ///< a worker that is gone is listed for as long
  std::size_t most_offline_shown = 100;        ///< number of such workers
  int max_leases_per_request = 64;             ///< whatever the worker asks for
  int max_returns_per_job = 16;                ///< attempts given back without charge; further ones are charged
  std::int64_t max_open_jobs = 4'000'000;      ///< open jobs of all active experiments; further submissions are refused
  std::int64_t max_open_jobs_per_submitter = 2'000'000;    ///< open jobs of one submitter's active experiments
  std::int64_t max_experiments = 100'000;                  ///< stored, active or not
  std::size_t max_summary_bytes = std::size_t{256} << 20;  ///< names, methods and tags of stored experiments, in memory
  std::int64_t max_jobs_in_memory = 8'000'000;  ///< jobs of experiments that are active or closed within `retention`
  std::int64_t max_open_experiments = 10'000;   ///< active, and closed within `retention`
  std::int64_t max_open_experiments_per_submitter = 5'000;           ///< those of one submitter
  std::size_t max_spec_bytes = std::size_t{128} << 20;               ///< specifications of these experiments
  std::size_t max_spec_bytes_per_submitter = std::size_t{32} << 20;  ///< those of one submitter
  std::size_t max_new_worker_bytes = std::size_t{64} << 20;  ///< memory of workers that never leased a job; when it is
                                                             ///< exceeded, the server forgets the longest silent ones
  microseconds new_worker_kept{600'000'000};        ///< time after which a silent worker that never leased is forgotten
  std::size_t max_gone_workers = 10'000;            ///< offline workers kept in memory; the database has them all
  double control_burst = 10'000;                    ///< control requests with an event that are accepted at once
  double controls_per_s = 10;                       ///< control requests with an event that are accepted for long
  std::int64_t disk_reserve_bytes = 1'000'000'000;  ///< free disk that submissions leave for results; at most
                                                    ///< kMostReservedShare of the disk
};

/// What the scheduler has seen since it was made.
struct SchedulerCounters {
  std::uint64_t submitted = 0, resubmitted = 0, submissions_refused = 0;
  std::uint64_t leases = 0, heartbeats = 0, renewals = 0, unknown_leases = 0, leases_expired = 0;
  std::uint64_t results_accepted = 0, results_duplicate = 0, results_stale = 0, results_refused = 0;
  std::uint64_t attempts_failed = 0, attempts_returned = 0, attempts_refused = 0, jobs_dead = 0, jobs_failed = 0,
                jobs_cancelled = 0;
  std::uint64_t jobs_retried = 0, jobs_deleted = 0, results_taken_over = 0;

  std::vector<std::pair<std::string_view, std::uint64_t>> Listing() const;
};

/// What decides which jobs a worker gets.
struct WorkerProfile {
  using Refused = std::map<std::pair<std::string, Task>, std::string>;

  Abilities abilities;
  bool draining = false;  ///< a person has asked it to leave: it gets no more jobs
  Refused refused;        ///< (method hash, task) of jobs that it has refused since its hello -> why

  bool operator==(const WorkerProfile&) const = default;
};

struct WorkerStatus {
  db::WorkerRecord record;
  bool online = false;
  microseconds last_seen{0};  ///< steady; 0: not since this server started
  std::int64_t leases = 0;
  WorkerProfile profile;
};

/// A leased job whose worker told how far it is.
struct JobProgress {
  std::int64_t job_id = 0;
  Task task{};
  std::int64_t worker_id = 0;
  std::int64_t done = 0, total = 0;  ///< windows of a windowed task, attempts otherwise
};

/// A lease at this moment.
struct LeaseView {
  std::int64_t job_id = 0;
  std::int64_t experiment_id = 0;
  std::int64_t worker_id = 0;
  microseconds since{0};  ///< steady; given, or taken up by this server
  std::int64_t progress_done = 0, progress_total = 0;
};

/// Decides who works on what: the queue semantics of lcmtypes/PROTOCOL.md as a pure state machine.
///
/// Each message handler takes the time and the message and returns the reply; what must be durable before that reply
/// may be sent is appended to `ops`. The caller applies the operations in order, whole batches at a time, and holds
/// back replies until the commit. It has no clock, thread, randomness or input/output of its own: tokens come from
/// `TokenSource`, what is no longer in memory from `Lookup`.
///
/// Promises, provided every batch is applied in order or the scheduler is thrown away:
///  - a submission id makes one experiment; with other content it is refused;
///  - a job has at most one lease at a time and at most one accepted result, under the token of its current lease;
///  - attempts count when leased; `max_attempts` charged attempts make a job dead, with the last evidence;
///  - a worker that falls silent costs at most one attempt per slot: those of its leases that were given first, as it
///    begins them in that order; what it held ready is queued again without a charge;
///  - after a restart from the store, running leases go on and can be completed by their workers;
///  - no job of a paused or held experiment is leased, and larger priorities are leased first;
///  - a job is leased only to a worker that has what it needs (capability.h) and has not refused jobs of its method and
///    task; a refusal is never charged;
///  - an experiment is finished by the build of the worker that took its first job, unless its spec or a person says
///    that any may;
///  - a job for which the store knows the finished result of an equal job when its first lease is due takes that over,
///    unless its spec says "again": of the build that finishes the experiment, where one does;
///  - what requests make last is bounded by `SchedulerOptions`: a submission beyond a limit is refused with the
///  numbers,
///    and a worker that never leased a job has no row in the store and is forgotten when it falls silent;
///  - among equal priorities submitters share the workers in equal parts of CPU time, and so do the experiments of each
///    (fair_share.h), from the start of this process on: what was used before it is forgotten.
///
/// Thread rule: one thread.
class Scheduler {
 public:
  using Ops = std::vector<db::StoreOp>;
  using TokenSource = std::function<std::int64_t()>;  ///< positive, unpredictable, never repeated
  /// What the store knows and the scheduler does not keep in memory. Only committed facts are asked for.
  struct Lookup {
    std::function<std::optional<db::AttemptRecord>(std::int64_t job_id, int attempt)> attempt;
    std::function<std::optional<std::string>(const std::string& method_hash)> method_options;
    std::function<std::optional<db::OpenExperiment>(std::int64_t experiment_id)> experiment;
    std::function<std::vector<db::KnownResult>(const db::ResultSearch&)> known_results;
    /// Space where the database is; may be empty or return nothing, then there is no reserve.
    std::function<std::optional<db::DiskSpace>()> disk_space = {};
    /// Whether the server hands out the dataset with this content hash; empty: none.
    std::function<bool(const std::string& dataset_hash)> dataset_offered = {};
  };

  /// Takes up where the store stands. Leases that were running get nine tenths of a lease from `now` on:
  /// their last renewal is older than `now`, so that a worker that is not heard of has stopped its job by then.
  /// Throws SpecError when a stored spec is not legal (a damaged or foreign database).
  Scheduler(const SchedulerOptions& options, db::OpenState state, TokenSource tokens, Lookup lookup,
            const Instant& now);

  legopt_msg::hello_reply Hello(const Instant& now, bus::EndpointId sender, const legopt_msg::hello_request& request,
                                Ops& ops);
  legopt_msg::lease_reply Lease(const Instant& now, bus::EndpointId sender, const legopt_msg::lease_request& request,
                                Ops& ops);
  legopt_msg::heartbeat_reply Heartbeat(const Instant& now, bus::EndpointId sender,
                                        const legopt_msg::heartbeat_request& request);
  legopt_msg::result_reply Result(const Instant& now, const legopt_msg::result_request& request, Ops& ops);
  legopt_msg::submit_reply Submit(const Instant& now, const legopt_msg::submit_request& request, Ops& ops);
  legopt_msg::cancel_reply Cancel(const Instant& now, const legopt_msg::cancel_request& request, Ops& ops);
  /// Pauses, resumes, holds, releases, favours, retries, renames, tags or deletes an experiment.
  legopt_msg::control_reply Control(const Instant& now, const legopt_msg::control_request& request, Ops& ops);

  /// Ends expired leases and forgets experiments closed long ago. Call it when next_deadline() is reached; later is
  /// allowed (leases then live longer). Not to be called while earlier operations wait for a failing store.
  void Tick(const Instant& now, Ops& ops);
  std::optional<microseconds> next_deadline() const;

  /// The server hands out the dataset with this content hash, or no longer does. Workers that fetch datasets count as
  /// able to take its jobs.
  void SetDatasetOffered(const std::string& hash, bool offered);

  /// While draining no job is leased; workers are told so. Everything else goes on.
  void set_draining(bool draining) { draining_ = draining; }
  /// Takes every running job back from its worker and puts it into the queue, without a charge.
  void GiveBackAllRunning(const Instant& now, const std::string& why, Ops& ops);

  /// All experiments, by id.
  const std::map<std::int64_t, db::ExperimentSummary>& experiments() const { return summaries_; }
  /// Workers that were heard of within a lease, those that still hold leases, and of the others the latest ones that
  /// were heard of within `offline_shown`, by id.
  std::vector<WorkerStatus> workers() const;
  /// Running jobs of an experiment that have told their progress, by job id; at most `most`.
  std::vector<JobProgress> Progress(std::int64_t experiment_id, std::size_t most) const;
  /// When the oldest lease was given, or taken up by this server; steady. Empty: nothing is leased.
  std::optional<microseconds> oldest_lease() const;
  /// All leases, in the order in which they were given.
  std::vector<LeaseView> LeasesInOrder() const;
  /// What the jobs of a group need of their worker, the build included.
  std::vector<Need> NeedsOf(const Experiment& experiment, const Experiment::Group& group) const;
  /// Whether the worker has the need, or can fetch the needed dataset from the server.
  bool CanGet(const WorkerProfile& worker, const Need& need) const;
  /// The needs that the worker cannot get, in their order.
  std::vector<Need> LacksOf(const WorkerProfile& worker, const std::vector<Need>& needs) const;
  /// Whether the worker can take jobs of the experiment, after it has fetched the dataset: queued ones, or any when
  /// none is queued.
  bool CanWorkOn(const WorkerProfile& worker, const Experiment& experiment) const;
  /// Null when the experiment is not in memory: unknown, or closed for longer than `retention`.
  const Experiment* InMemory(std::int64_t experiment_id) const;
  const SchedulerOptions& options() const { return options_; }
  bool draining() const { return draining_; }
  const SchedulerCounters& counters() const { return counters_; }
  std::int64_t num_leases() const { return static_cast<std::int64_t>(leases_.size()); }
  std::int64_t num_queued() const { return num_queued_; }

 private:
  struct LeaseState {
    std::int64_t worker_id = 0;
    microseconds expires{0};
    bool confirmed = false;                    ///< listed by a heartbeat of its worker
    std::int64_t order = 0;                    ///< in which leases were given: their worker begins them so
    microseconds since{0};                     ///< it was given, or this server started
    std::int64_t expected_us = 0;              ///< CPU time that it was charged beforehand
    std::optional<std::int64_t> used_us = {};  ///< that it used, as told
    std::int64_t progress_done = 0, progress_total = 0;
  };
  struct Worker {
    db::WorkerRecord record;
    WorkerProfile profile;
    microseconds last_seen{0};
    microseconds stored_seen{0};           ///< last_seen when it was last written
    bool online = false;                   ///< set by SetOnline only
    bool leaving = false;                  ///< it has said that it ends
    bool stored = false;                   ///< it has a row in the store: it has leased a job
    std::size_t new_bytes = 0;             ///< its part of new_worker_bytes_, while not stored
    int online_slots = 0;                  ///< its part of online_slots_
    std::optional<WorkerProfile> counted;  ///< as which it is counted among the able workers of groups
    std::int64_t leases = 0;
    int charged = 0;  ///< leases that expired at its cost since it was last heard of
  };
  struct JobRef {
    Experiment* experiment = nullptr;
    std::int64_t index = 0;
  };

  // scheduler_budget.cpp
  std::string OverBudget(const ExperimentSpec& spec) const;
  std::string OverBudgetInMemory(const ExperimentSpec& spec) const;
  std::string OverDiskReserve(const ExperimentSpec& spec) const;
  std::string OverControlRate(const Instant& now);
  // scheduler.cpp
  void AddExperiment(const db::NewExperiment& rows, ExperimentSpec spec);
  Worker* FindWorker(std::int64_t worker_id, bus::EndpointId sender);
  void Hear(Worker& worker, const Instant& now);
  JobRef FindJob(std::int64_t job_id);
  void SetJobState(Experiment& experiment, std::int64_t index, db::JobState state);
  void Close(const Instant& now, Experiment& experiment, db::ExperimentState state);
  void FinishIfComplete(const Instant& now, Experiment& experiment, Ops& ops);
  void AddLease(Experiment& experiment, std::int64_t index, LeaseState lease);
  void DropLease(const Instant& now, const JobRef& ref);
  void UpdateWaiting(Experiment& experiment);
  void AddOpen(std::unique_ptr<Experiment> experiment);
  void Open(const Instant& now, const db::OpenExperiment& open);
  // scheduler_control.cpp
  legopt_msg::control_reply SetHold(const Instant& now, const legopt_msg::control_request& request, Ops& ops);
  legopt_msg::control_reply SetPriority(const Instant& now, const legopt_msg::control_request& request, Ops& ops);
  legopt_msg::control_reply Retry(const Instant& now, std::int64_t experiment_id, bool time_limited, Ops& ops);
  std::int64_t QueueAgain(Experiment& experiment, bool time_limited);
  legopt_msg::control_reply Rename(const Instant& now, const legopt_msg::control_request& request, Ops& ops);
  legopt_msg::control_reply SetTag(const legopt_msg::control_request& request, Ops& ops);
  legopt_msg::control_reply DrainWorker(const Instant& now, std::int64_t worker_id, Ops& ops);
  legopt_msg::control_reply Delete(const Instant& now, std::int64_t experiment_id, Ops& ops);
  void NoteDeleted(std::int64_t first, std::int64_t end);
  std::int64_t GiveBackRunning(const Instant& now, Experiment& experiment, const std::string& why, Ops& ops);
  // scheduler_capabilities.cpp
  enum class Datasets : std::uint8_t { kPresent, kPresentOrOffered };
  bool Admits(const WorkerProfile& worker, const Experiment& experiment, const Experiment::Group& group,
              Datasets datasets) const;
  std::string WantedDataset(const WorkerProfile& worker) const;
  void UpdateOffered(const std::string& hash);
  void CountWorker(const WorkerProfile& worker, int change);
  void RecountWorkers(Experiment& experiment);
  void SetOnline(Worker& worker, bool online);
  std::string MismatchOf(const Worker& worker, bool* same_name) const;
  void NoteRefusal(const Instant& now, const JobRef& ref, const std::string& why, Ops& ops);
  // scheduler_workers.cpp
  Worker& WorkerOf(bus::EndpointId sender);
  void StoreSighting(Worker& worker, Ops& ops);
  void Enlist(const Instant& now, Worker& worker, Ops& ops);
  void CountNew(Worker& worker, std::size_t bytes);
  void LookAtWorkers(const Instant& now, Ops& ops);
  void ForgetNewWorker(std::int64_t worker_id);
  void BoundNewWorkers(std::int64_t newest);
  void ForgetGoneWorkers();
  // scheduler_leases.cpp
  void Bind(const Instant& now, Experiment& experiment, const Worker& worker, Ops& ops);
  legopt_msg::lease LeaseFrom(const Instant& now, Experiment& experiment, std::int64_t index, Worker& worker, Ops& ops);
  int BatchSize(int wanted) const;
  void ExpireLeases(const Instant& now, Ops& ops);
  void ExpireLease(const Instant& now, std::int64_t job_id, bool may_have_begun, Ops& ops);
  // scheduler_takeover.cpp
  void TakeOverKnown(const Instant& now, Experiment& experiment, const Experiment::Range& range, const Worker& worker,
                     Ops& ops);
  std::vector<db::KnownResult> KnownResultsOf(const Experiment& experiment, const Experiment::Range& range,
                                              const Worker& worker) const;
  void TakeOver(const Instant& now, Experiment& experiment, std::int64_t index, const db::KnownResult& known, Ops& ops);
  // scheduler_results.cpp
  legopt_msg::result_reply AcceptCurrent(const Instant& now, const JobRef& ref,
                                         const legopt_msg::result_request& request, Ops& ops);
  enum class Charge : std::uint8_t { kNever, kByOutcome };
  void EndCurrent(const Instant& now, const JobRef& ref, db::EndAttempt end, Ops& ops,
                  Charge charge = Charge::kByOutcome);
  legopt_msg::result_reply AnswerEnded(const Instant& now, const db::AttemptRecord& record,
                                       const legopt_msg::result_request& request, Ops& ops);
  bool IsDeleted(std::int64_t job_id) const;
  // scheduler_view.cpp
  void CountWork(microseconds elapsed);
  std::optional<db::AttemptRecord> AttemptOf(const JobRef& ref, std::int64_t job_id, int attempt) const;

  SchedulerOptions options_;
  TokenSource tokens_;
  Lookup lookup_;
  std::int64_t next_experiment_id_, next_job_id_, next_cell_id_, next_worker_id_;
  std::map<std::int64_t, db::ExperimentSummary> summaries_;
  std::map<std::string, std::int64_t> submissions_;           ///< submission id -> experiment
  std::map<std::int64_t, std::unique_ptr<Experiment>> open_;  ///< by experiment id; closed ones until retention
  std::map<std::int64_t, Experiment*> by_first_job_;
  std::map<std::int64_t, std::int64_t> deleted_jobs_;  ///< first -> after the last, of what this process has deleted
  FairShare shares_;                                   ///< of open_
  std::set<std::string> offered_datasets_;             ///< content hashes of datasets that the server hands out
  std::int64_t num_queued_ = 0;                        ///< jobs of all experiments
  std::int64_t num_leasable_ = 0;                      ///< of these, not paused or held
  std::map<std::int64_t, Worker> workers_;             ///< by worker id
  std::map<bus::EndpointId, std::int64_t>
      worker_of_endpoint_;            ///< number of each worker in workers_ and of stored workers no longer in memory
  std::size_t new_worker_bytes_ = 0;  ///< memory of the workers that are not stored
  std::size_t summary_bytes_ = 0;     ///< SummaryBytes of summaries_
  RateLimit controls_;
  std::map<std::int64_t, LeaseState> leases_;  ///< by job id
  std::int64_t next_order_ = 0;
  std::int64_t online_workers_ = 0, online_slots_ = 0;
  microseconds next_scan_{0};
  bool draining_ = false;
  std::int64_t wall_us_ = 0;  ///< at the last message or tick
  SchedulerCounters counters_;
};

}  // namespace legopt::server
