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
#include "db/database_file.h"
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

namespace legopt::server {

using std::chrono::microseconds;

/// The time at which a message is handled. Decisions depend only on `steady`; `wall_us` (microseconds since 1970) is
/// stored in rows for display and may jump.
struct Instant {
  microseconds steady{0};
  std::int64_t wall_us = 0;
};

struct SchedulerOptions {
  std::int64_t server_instance = 0;            ///< random id of this server process
  microseconds lease{10'000'000};              ///< lease duration; renewed by every heartbeat that lists the lease
  microseconds grace{1'500'000};               ///< waiting time after the end of a lease; the worker stops the job
                                               ///< before
  microseconds heartbeat{500'000};             ///< heartbeat interval of workers; a cancelled job continues for up to
                                               ///< this time
  microseconds expiry_scan{100'000};           ///< interval at which Tick checks for expired leases
  microseconds sighting{60'000'000};           ///< interval at which a worker's last-seen time is stored
  microseconds retention{60'000'000};          ///< time that closed experiments stay in memory for late messages
  microseconds min_retry{50'000};              ///< shortest retry interval of workers without jobs
  microseconds retry_per_worker{2'000};        ///< multiplied by the number of workers; bounds the rate of requests
                                               ///< from idle workers
  microseconds offline_shown{86'400'000'000};  ///< time that an offline worker is listed
  std::size_t most_offline_shown = 100;        ///< maximum number of listed offline workers
  int max_leases_per_request = 64;             ///< upper bound, whatever the worker requests
  int max_returns_per_job = 16;                ///< attempts that may be released without charge; further ones are
                                               ///< charged
  std::int64_t max_open_jobs = 4'000'000;      ///< open jobs of all active experiments; further submissions are refused
  std::int64_t max_open_jobs_per_submitter = 2'000'000;    ///< open jobs of one submitter's active experiments
  std::int64_t max_experiments = 100'000;                  ///< stored experiments, active or not
  std::size_t max_summary_bytes = std::size_t{256} << 20;  ///< memory for names, methods and tags of stored experiments
  std::int64_t max_jobs_in_memory = 8'000'000;  ///< jobs of experiments that are active or were closed within
                                                ///< `retention`
  std::int64_t max_open_experiments = 10'000;   ///< experiments that are active or were closed within `retention`
  std::int64_t max_open_experiments_per_submitter = 5'000;           ///< such experiments of one submitter
  std::size_t max_spec_bytes = std::size_t{128} << 20;               ///< memory for the specs of these experiments
  std::size_t max_spec_bytes_per_submitter = std::size_t{32} << 20;  ///< memory for the specs of one submitter
  std::size_t max_new_worker_bytes = std::size_t{16} << 20;  ///< memory of workers that never leased a job; above the
                                                             ///< limit, the workers silent for longest are removed
  microseconds new_worker_kept{600'000'000};        ///< time after which a silent worker that never leased a job is
                                                    ///< removed
  std::size_t max_gone_workers = 10'000;            ///< offline workers kept in memory; the database stores all
  double control_burst = 10'000;                    ///< control requests that are accepted at once (those that record
                                                    ///< an event)
  double controls_per_s = 10;                       ///< sustained rate of these control requests
  std::int64_t disk_reserve_bytes = 1'000'000'000;  ///< disk space that submissions leave free for results; at most
                                                    ///< kMaxReservedShare of the disk
};

/// Event counters since the scheduler was created.
struct SchedulerCounters {
  std::uint64_t submitted = 0, resubmitted = 0, submissions_refused = 0;
  std::uint64_t leases = 0, heartbeats = 0, renewals = 0, unknown_leases = 0, leases_expired = 0;
  std::uint64_t results_accepted = 0, results_duplicate = 0, results_stale = 0, results_refused = 0;
  std::uint64_t attempts_failed = 0, attempts_returned = 0, attempts_refused = 0, jobs_dead = 0, jobs_failed = 0,
                jobs_cancelled = 0;
  std::uint64_t jobs_retried = 0, jobs_deleted = 0, results_taken_over = 0;

  std::vector<std::pair<std::string_view, std::uint64_t>> Listing() const;
};

/// Properties that determine which jobs a worker gets.
struct WorkerProfile {
  using Refused = std::map<std::pair<std::string, Task>, std::string>;

  WorkerCapabilities abilities;
  bool draining = false;  ///< draining was requested: the worker gets no more jobs
  Refused refused;        ///< (method hash, task) of jobs that it refused since its hello -> reason

  bool operator==(const WorkerProfile&) const = default;
};

struct WorkerStatus {
  db::WorkerRecord record;
  bool online = false;
  microseconds last_seen{0};  ///< steady time; 0: not seen since this server started
  std::int64_t leases = 0;
  WorkerProfile profile;
  bool enlisted = false;  ///< it has leased a job at least once
};

/// Progress of a leased job, as reported by its worker.
struct JobProgress {
  std::int64_t job_id = 0;
  Task task{};
  std::int64_t worker_id = 0;
  std::int64_t done = 0, total = 0;  ///< windows of a windowed task, attempts of others
};

/// State of a lease.
struct LeaseView {
  std::int64_t job_id = 0;
  std::int64_t experiment_id = 0;
  std::int64_t worker_id = 0;
  microseconds since{0};  ///< steady time when it was granted, or restored by this server
  std::int64_t progress_done = 0, progress_total = 0;
};

/// Assigns jobs to workers: the queue semantics of lcmtypes/PROTOCOL.md as a pure state machine.
///
/// Each message handler takes the time and the message and returns the reply. Operations that must be durable before
/// the reply is sent are appended to `ops`. The caller applies the operations in order, in whole batches, and delays
/// replies until the commit. The scheduler has no clock, threads, random numbers or input/output: tokens come from
/// `TokenSource`, data that is not in memory from `Lookup`.
///
/// Guarantees, provided that every batch is applied in order or the scheduler is discarded:
/// * A submission id creates one experiment; reusing it with other content is refused.
/// * A job has at most one lease at a time and at most one accepted result, under the token of its current lease.
/// * Attempts are counted when leased; after `max_attempts` charged attempts a job is dead, and the last error is kept.
/// * A worker that falls silent costs at most one attempt per slot: its oldest leases, because it starts jobs in that
///   order. Prefetched jobs are re-queued without a charge.
/// * After a restart from the store, running leases continue and can be completed by their workers.
/// * Jobs of paused or held experiments are not leased; larger priorities are leased first.
/// * A job is leased only to a worker that satisfies its requirements (capability.h) and has not refused a job of the
///   same method and task; a refusal is never charged.
/// * An experiment is finished by the build of the worker that took its first job, unless its spec or a user allows any
///   build.
/// * If the store has the finished result of an identical job when a job is about to be leased for the first time, the
///   result is reused, unless the spec says "again"; only results of the experiment's build are reused if it is
///   restricted to one.
/// * The state that requests leave behind is bounded by `SchedulerOptions`: a submission beyond a limit is refused with
///   the numbers. A worker that never leased a job has no row in the store and is removed when it falls silent.
/// * Within a priority, submitters get equal shares of CPU time, and so do the experiments of each submitter
///   (fair_share.h). Only time used since the start of this process counts.
///
/// Thread rule: one thread.
class Scheduler {
 public:
  using Ops = std::vector<db::StoreOp>;
  using TokenSource = std::function<std::int64_t()>;  ///< positive, unpredictable, never repeated
  /// Access to stored data that the scheduler does not keep in memory. Only committed data is requested.
  struct Lookup {
    std::function<std::optional<db::AttemptRecord>(std::int64_t job_id, int attempt)> attempt;
    std::function<std::optional<std::string>(const std::string& method_hash)> method_options;
    std::function<std::optional<db::OpenExperiment>(std::int64_t experiment_id)> experiment;
    std::function<std::vector<db::KnownResult>(const db::ResultSearch&)> known_results;
    /// Disk space of the database's file system; may be empty or return nullopt, then nothing is reserved.
    std::function<std::optional<db::DiskSpace>()> disk_space = {};
    /// Returns whether the server offers the dataset with this content hash; empty: none.
    std::function<bool(const std::string& dataset_hash)> dataset_offered = {};
  };

  /// Resumes from the stored state. Leases that were running end nine tenths of a lease after `now`: they were last
  /// renewed before `now`, so a worker that is not heard of has stopped its job by then. Throws SpecError if a stored
  /// spec is illegal (a damaged or foreign database).
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
  /// Pauses, resumes, holds, releases, prioritizes, retries, renames, tags or deletes an experiment.
  legopt_msg::control_reply Control(const Instant& now, const legopt_msg::control_request& request, Ops& ops);

  /// Ends expired leases and removes experiments closed long ago from memory. Call it when next_deadline() is reached;
  /// a later call is allowed (leases then live longer). Must not be called while earlier operations wait for a failing
  /// store.
  void Tick(const Instant& now, Ops& ops);
  std::optional<microseconds> next_deadline() const;

  /// Sets whether the server offers the dataset with this content hash. Workers that fetch datasets then count as able
  /// to run its jobs.
  void SetDatasetOffered(const std::string& hash, bool offered);

  /// While draining, no job is leased, and workers are informed; all other functions continue.
  void set_draining(bool draining) { draining_ = draining; }
  /// Ends all running attempts and re-queues their jobs without a charge.
  void RequeueAllRunning(const Instant& now, const std::string& why, Ops& ops);

  /// All experiments, by id.
  const std::map<std::int64_t, db::ExperimentSummary>& experiments() const { return summaries_; }
  /// Returns, by id: workers heard of within a lease, workers with leases, and of the others the latest ones that were
  /// heard of within `offline_shown`.
  std::vector<WorkerStatus> workers() const;
  /// Returns at most `most` running jobs of an experiment with reported progress, by job id.
  std::vector<JobProgress> Progress(std::int64_t experiment_id, std::size_t most) const;
  /// Steady time at which the oldest lease was granted or restored; nullopt without leases.
  std::optional<microseconds> oldest_lease() const;
  /// All leases, in the order in which they were granted.
  std::vector<LeaseView> LeasesInOrder() const;
  /// Returns the requirements of a group's jobs, including the build.
  std::vector<JobRequirement> NeedsOf(const Experiment& experiment, const Experiment::Group& group) const;
  /// Returns whether the worker satisfies the need, or can fetch the needed dataset from the server.
  bool CanSatisfy(const WorkerProfile& worker, const JobRequirement& need) const;
  /// Returns the needs that the worker cannot satisfy, in their order.
  std::vector<JobRequirement> UnmetNeeds(const WorkerProfile& worker, const std::vector<JobRequirement>& needs) const;
  /// Returns whether the worker can run queued jobs of the experiment (any jobs if none is queued), possibly after
  /// fetching the dataset.
  bool CanWorkOn(const WorkerProfile& worker, const Experiment& experiment) const;
  /// Returns nullptr if the experiment is not in memory: unknown, or closed for longer than `retention`.
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
    bool confirmed = false;                    ///< a heartbeat of the worker has listed it
    std::int64_t order = 0;                    ///< sequence number; workers start jobs in this order
    microseconds since{0};                     ///< when it was granted, or this server started
    std::int64_t expected_us = 0;              ///< expected CPU time, charged at the start
    std::optional<std::int64_t> used_us = {};  ///< CPU time reported by the worker
    std::int64_t progress_done = 0, progress_total = 0;
  };
  struct Worker {
    db::WorkerRecord record;
    WorkerProfile profile;
    microseconds last_seen{0};
    microseconds stored_seen{0};           ///< value of last_seen when it was last stored
    bool online = false;                   ///< set by SetOnline only
    bool leaving = false;                  ///< it announced its end
    bool stored = false;                   ///< it has a row in the store, because it has leased a job
    std::size_t new_bytes = 0;             ///< its contribution to new_worker_bytes_ while not stored
    int online_slots = 0;                  ///< its contribution to online_slots_
    std::optional<WorkerProfile> counted;  ///< profile with which it is counted as an able worker of groups
    std::int64_t leases = 0;
    int charged = 0;  ///< number of charged leases that expired since its last message
  };
  struct JobRef {
    Experiment* experiment = nullptr;
    std::int64_t index = 0;
  };

  // budget.cpp
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
  static bool RunsJobs(const Experiment& experiment);
  legopt_msg::control_reply SetPriority(const Instant& now, const legopt_msg::control_request& request, Ops& ops);
  legopt_msg::control_reply Retry(const Instant& now, std::int64_t experiment_id, bool time_limited, Ops& ops);
  std::int64_t QueueAgain(Experiment& experiment, bool time_limited);
  legopt_msg::control_reply Rename(const Instant& now, const legopt_msg::control_request& request, Ops& ops);
  legopt_msg::control_reply SetTag(const legopt_msg::control_request& request, Ops& ops);
  legopt_msg::control_reply DrainWorker(const Instant& now, std::int64_t worker_id, Ops& ops);
  legopt_msg::control_reply Delete(const Instant& now, std::int64_t experiment_id, Ops& ops);
  void NoteDeleted(std::int64_t first, std::int64_t end);
  std::int64_t RequeueRunning(const Instant& now, Experiment& experiment, const std::string& why, Ops& ops);
  // scheduler_workers.cpp
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
  void UpdateWorkerStates(const Instant& now, Ops& ops);
  void EvictNewWorker(std::int64_t worker_id);
  void LimitNewWorkerMemory(std::int64_t newest);
  void EvictOfflineWorkers();
  // scheduler_leases.cpp
  void Bind(const Instant& now, Experiment& experiment, const Worker& worker, Ops& ops);
  legopt_msg::lease LeaseFrom(const Instant& now, Experiment& experiment, std::int64_t index, Worker& worker, Ops& ops);
  int BatchSize(int wanted) const;
  void ExpireLeases(const Instant& now, Ops& ops);
  void ExpireLease(const Instant& now, std::int64_t job_id, bool may_have_begun, Ops& ops);
  // scheduler_results.cpp
  std::int64_t ReuseKnownResults(const Instant& now, Experiment& experiment, const std::vector<std::int64_t>& jobs,
                                 const Worker& worker, Ops& ops);
  std::vector<db::KnownResult> KnownResultsOf(const Experiment& experiment, const std::vector<std::int64_t>& jobs,
                                              const Worker& worker) const;
  void ReuseStoredResult(const Instant& now, Experiment& experiment, std::int64_t index, const db::KnownResult& known,
                         Ops& ops);
  legopt_msg::result_reply AcceptCurrent(const Instant& now, const JobRef& ref,
                                         const legopt_msg::result_request& request, Ops& ops);
  enum class Charge : std::uint8_t { kNever, kByOutcome };
  void EndCurrent(const Instant& now, const JobRef& ref, db::EndAttempt end, Ops& ops,
                  Charge charge = Charge::kByOutcome);
  legopt_msg::result_reply AnswerEnded(const Instant& now, const db::AttemptRecord& record,
                                       const legopt_msg::result_request& request, Ops& ops);
  bool IsDeleted(std::int64_t job_id) const;
  // scheduler.cpp
  void CountWork(microseconds elapsed);
  std::optional<db::AttemptRecord> AttemptOf(const JobRef& ref, std::int64_t job_id, int attempt) const;

  SchedulerOptions options_;
  TokenSource tokens_;
  Lookup lookup_;
  std::int64_t next_experiment_id_, next_job_id_, next_cell_id_, next_worker_id_;
  std::map<std::int64_t, db::ExperimentSummary> summaries_;
  std::map<std::string, std::int64_t> submissions_;           ///< submission id -> experiment
  std::map<std::int64_t, std::unique_ptr<Experiment>> open_;  ///< key: experiment id; closed ones until `retention`
  std::map<std::int64_t, Experiment*> by_first_job_;
  std::map<std::int64_t, std::int64_t> deleted_jobs_;  ///< ranges deleted by this process: first -> one after the last
  FairShare shares_;                                   ///< contains the experiments of open_
  std::set<std::string> offered_datasets_;             ///< content hashes of datasets that the server offers
  std::int64_t num_queued_ = 0;                        ///< queued jobs of all experiments
  std::int64_t num_leasable_ = 0;                      ///< queued jobs that are not paused or held
  std::map<std::int64_t, Worker> workers_;             ///< key: worker id
  std::map<bus::EndpointId, std::int64_t> worker_of_endpoint_;  ///< worker id of each worker in workers_ and of stored
                                                                ///< workers no longer in memory
  std::size_t new_worker_bytes_ = 0;                            ///< memory of the workers that are not stored
  std::size_t summary_bytes_ = 0;                               ///< total SummaryBytes of summaries_
  RateLimit controls_;
  std::map<std::int64_t, LeaseState> leases_;  ///< key: job id
  std::int64_t next_order_ = 0;
  std::int64_t online_workers_ = 0, online_slots_ = 0;
  microseconds next_scan_{0};
  bool draining_ = false;
  std::int64_t wall_us_ = 0;  ///< wall time of the last message or tick
  SchedulerCounters counters_;
};

}  // namespace legopt::server
