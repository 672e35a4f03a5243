#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "legopt/types/task.h"
#include "legopt_msg/heartbeat_reply.hpp"
#include "legopt_msg/hello_reply.hpp"
#include "legopt_msg/lease_reply.hpp"
#include "legopt_msg/method_reply.hpp"
#include "legopt_msg/result_reply.hpp"
#include "worker/actions.h"
#include "worker/job_executor.h"
#include "worker/job_slot.h"

namespace legopt::worker {

struct PoolOptions {
  int slots = 1;  ///< >= 1
  std::string name;
  std::string hostname;
  std::int64_t pid = 0;
  std::string build;                                  ///< description for humans
  std::string build_id;                               ///< 1 .. 64 bytes; equal for builds that compute the same bits
  std::string processor;                              ///< processor model of the host
  std::int32_t processors = 1;                        ///< processors granted to the worker, >= 1
  std::int64_t memory_bytes = 0;                      ///< memory of the host; 0: unknown
  std::function<double()> load = [] { return 0.0; };  ///< current load of the host; NaN: unknown
  std::int32_t protocol_version = 1;
  std::string server_address;               ///< shown in messages: "GROUP:PORT", or all addresses that a bridge tries
  bool bridged = false;                     ///< shown in messages: the server is reached over a bridge
  std::string key_file;                     ///< shown in messages; empty: the deployment has no key
  bool fetch_datasets = false;              ///< end when idle to fetch a dataset that the server wants, see Pool
  std::vector<std::string> unfetched = {};  ///< content hashes of datasets that could not be fetched or loaded
  bool exit_when_idle = false;  ///< exit when the server reports that there is no more work (PROTOCOL.md, 9)
  /// Exit with ExitCode::kUnreachable after this time without a message from the server; max(): keep trying.
  microseconds wait_server = microseconds::max();
  SlotTimes slot_times;
  /// Amount of work to prefetch per slot, so that short jobs need not wait for the network. The number of leases
  /// follows from the average duration of a job. Long jobs are not prefetched, because an idle slot of another worker
  /// may take them. The actual amount is four times the response time of the server, between `prefetch` and
  /// `longest_prefetch`.
  microseconds prefetch = std::chrono::milliseconds(60);
  microseconds longest_prefetch = std::chrono::milliseconds(250);
  int max_prefetch_per_slot = 64;
  /// Maximum time that a prefetched lease waits. If the previous jobs take longer than estimated, it is released,
  /// because another worker may have an idle slot.
  microseconds max_prefetch_wait = std::chrono::seconds(2);
  /// Exit after this time without a job, whether or not there is a server; counted from when the first process is
  /// ready.
  microseconds idle_timeout = microseconds::max();
  /// Maximum time that running jobs may continue after the first order to stop; then they are released. Less than the
  /// time between TERM and KILL in docker (10 s; Slurm and Kubernetes 30 s): a killed job costs an attempt, a released
  /// one only its time.
  microseconds drain = std::chrono::seconds(8);
  /// Maximum time for offering the last results to a silent server, after the jobs have ended or after the second
  /// order. After a signal to stop, a worker ends within 9.5 s, or within 1.5 s after a longer drain.
  microseconds delivery_limit = std::chrono::seconds(15);
  microseconds kill_limit = std::chrono::seconds(1);
  std::uint64_t seed = 1;  ///< seed for the jitter of intervals; workers should differ
};

/// Makes all decisions of a worker: registration, leases, assignment to slots, stopping of jobs, delivery of results.
/// Pure state machine: events with their time are inputs, actions are outputs (TakeActions). It owns no process, socket
/// or clock. Time is steady, since an arbitrary start, and never decreases.
///
/// Guarantees:
///  - the duration of a lease counts from before its request; its job is stopped a tenth of the lease before it could
///    expire without renewal;
///  - a result is offered until the server has answered it, across restarts of the server;
///  - heartbeats cover running jobs, prefetched leases, and results being delivered;
///  - jobs start in the order of their leases; only few are prefetched, and those that would wait long are released;
///  - a misbehaving job process costs one attempt of its job, and nothing else;
///  - only datasets that a job process has loaded and hashed are announced, and only their jobs are accepted;
///  - with `fetch_datasets`, a pool without jobs and leases ends when the server names a dataset to fetch. The caller
///    fetches it and starts another pool, which the server treats as the same worker.
///
/// One thread.
class Pool {
 public:
  Pool(PoolOptions options, microseconds now);

  // --- Events of the job processes -----------------------------------------------------------------------------------
  /// `capabilities`: those it has loaded; at least one dataset.
  void OnChildReady(microseconds now, int slot, const std::vector<Capability>& capabilities);
  /// The process reports that its datasets cannot be used, with the reason in `message`; its exit follows.
  void OnChildStartFailed(microseconds now, int slot, const std::string& message);
  void OnChildProgress(microseconds now, int slot, std::uint64_t sequence, int done, int total);
  void OnChildJudging(microseconds now, int slot, std::uint64_t sequence);
  void OnChildResult(microseconds now, int slot, std::uint64_t sequence, legopt_msg::result_request result);
  void OnChildGarbage(microseconds now, int slot, const std::string& why);
  void OnChildExited(microseconds now, int slot, const ChildExit& exit);

  // --- Answers of the server; a null reply means time-out or refusal, with the reason in `error` ---------------------
  void OnHelloReply(microseconds now, const legopt_msg::hello_reply* reply, const std::string& error);
  void OnLeaseReply(microseconds now, const legopt_msg::lease_reply* reply, const std::string& error);
  void OnHeartbeatReply(microseconds now, const legopt_msg::heartbeat_reply* reply, const std::string& error);
  void OnMethodReply(microseconds now, const std::string& hash, const legopt_msg::method_reply* reply,
                     const std::string& error);
  void OnResultReply(microseconds now, const LeaseKey& key, const legopt_msg::result_reply* reply,
                     const std::string& error);

  /// The server refused a call because of the role of this worker's key. Called before the function for the call's
  /// reply.
  void OnKeyRefused(microseconds now, const std::string& error);

  // --- Orders and time -----------------------------------------------------------------------------------------------
  /// First call: take no more jobs, release those not started, finish and deliver the rest; jobs still running after
  /// `drain` are killed and released. Exits with ExitCode::kOk. Second call: kill and release running jobs, exit with
  /// ExitCode::kInterrupted. Third call: exit immediately.
  void Stop(microseconds now);
  /// Performs actions that are due. Must be called at next_deadline() at the latest.
  void Tick(microseconds now);

  /// Next time for Tick; max() if only an event can change anything.
  microseconds next_deadline() const;
  /// Returns the requested actions in order, and clears the list.
  std::vector<Action> TakeActions();

  bool registered() const { return registration_.has_value(); }
  /// Number of leases held: ready, running, and delivering.
  std::size_t num_leases() const { return leases_.size(); }
  std::size_t num_running() const;
  std::size_t num_undelivered() const;

  /// Content hash of the dataset to fetch, if the pool ended to fetch one; otherwise empty.
  const std::string& ended_to_fetch() const { return ended_to_fetch_; }
  /// Whether a job process has loaded its datasets.
  bool has_loaded() const { return !capabilities_.empty(); }

  /// Time limits of the calls made for a pool; the limit of a heartbeat is its interval.
  microseconds lease_call_timeout() const;
  microseconds heartbeat_interval() const;

 private:
  static constexpr double kAverageWeight = 0.2;  // weight of the newest value in a moving average
  enum class Phase { kReady, kRunning, kDelivering };
  struct HeldLease {
    legopt_msg::lease lease;
    Task task{};
    Phase phase = Phase::kReady;
    microseconds expires{0};   // time by which its job must have been stopped
    microseconds accepted{0};  // time of receipt
    std::int64_t progress_done = 0;
    std::int64_t progress_total = 0;
    // Delivery:
    std::shared_ptr<const legopt_msg::result_request> result;
    bool in_flight = false;
    microseconds next_delivery{0};
    microseconds delivery_backoff{0};
  };
  struct MethodEntry {
    std::shared_ptr<const std::string> options_json;  // null while requested
    bool in_flight = false;
    microseconds next_try{0};
    microseconds backoff{0};
  };
  struct Registration {
    std::int64_t worker_id = 0;
    std::int64_t server_instance = 0;
    microseconds lease{0};
    microseconds heartbeat{0};
  };
  struct SlotEntry {
    JobSlot machine;
    LeaseKey key;  // valid while machine.has_job()
  };

  // pool.cpp: registration, leases
  void Advance(microseconds now);
  void AskForRegistration(microseconds now);
  void AskForLeases(microseconds now);
  void AskForMethods(microseconds now);
  void SendHeartbeat(microseconds now);
  void ExpireLeases(microseconds now);
  void AcceptLease(microseconds now, const legopt_msg::lease& lease);
  void HeardServer(microseconds now);
  void ServerSilent(microseconds now, const std::string& error);
  void ForgetRegistration(microseconds now, const std::string& why);
  microseconds Jittered(microseconds duration);
  void LogOnce(const std::string& server_message);
  std::string MismatchText(const std::string& server_message) const;
  bool HasDataset(const std::string& hash) const;
  microseconds StopMargin(const legopt_msg::lease& lease) const;
  int NumWantedLeases() const;
  int NumAheadPerSlot() const;
  bool HoldsLongJob() const;
  void Log(LogLevel level, std::string text);
  static std::string Seconds(microseconds duration);

  // pool_end.cpp
  void CheckEnd(microseconds now);
  void CheckDrained(microseconds now);
  bool CheckIdle(microseconds now);
  microseconds DeliveryEnd() const;
  microseconds LeaseAnswerEnd() const;
  microseconds IdleEnd() const;
  void Drain(microseconds now, ExitCode exit_code);
  void EndDrain(microseconds now);
  void ReleaseRunning();
  void SendLeavingHeartbeat();
  void Finish(ExitCode exit_code);
  void DrainForServer(microseconds now);
  std::string CausesOfSilence() const;

  // pool_jobs.cpp: slots, results
  void AdvanceSlots(microseconds now);
  void ApplyCommand(int slot, JobSlot::Command command);
  void Dispatch(microseconds now);
  std::size_t NumIn(Phase phase) const;
  bool CanDeliver() const;
  void DeliverResults(microseconds now);
  void EndStoppedJob(microseconds now, const LeaseKey& key, StopReason reason);
  void EndKilledJob(microseconds now, const SlotEntry& slot, const ChildExit& exit);
  bool WasStoppedExternally(const JobSlot& machine, const ChildExit& exit) const;
  void KeepResult(microseconds now, const LeaseKey& key, legopt_msg::result_request result);
  void FailLease(microseconds now, const LeaseKey& key, const std::string& message);
  void RefuseLease(microseconds now, const LeaseKey& key, const std::string& message);
  void ReleaseReady(microseconds now);
  void ReleaseWaiting(microseconds now);
  std::optional<microseconds> WaitEnd() const;
  void StopLease(microseconds now, const LeaseKey& key, StopReason reason);
  void RecordJobDuration(microseconds duration);
  void CheckStarts(const ChildExit& last);

  PoolOptions options_;
  std::vector<SlotEntry> slots_;
  std::vector<Action> actions_;
  std::map<LeaseKey, HeldLease> leases_;
  std::deque<LeaseKey> ready_;  // leases that wait for a slot, in the order of their leases
  std::map<std::string, MethodEntry> methods_;

  std::vector<Capability> capabilities_;  // capabilities in the hello; empty until the first process is ready
  std::optional<Registration> registration_;
  bool hello_in_flight_ = false;
  std::size_t announced_ = 0;  // number of capabilities in the last hello
  microseconds next_hello_{0};
  microseconds hello_backoff_{0};

  bool lease_in_flight_ = false;
  microseconds lease_asked_at_{0};
  microseconds next_lease_{0};
  bool no_more_work_ = false;
  std::string wanted_dataset_;  // content hash in the last lease reply; empty: none
  std::string ended_to_fetch_;
  std::string last_logged_message_;  // last message of the server that was logged
  std::minstd_rand random_;

  bool heartbeat_in_flight_ = false;
  microseconds heartbeat_sent_at_{0};
  microseconds next_heartbeat_{0};
  std::vector<LeaseKey> heartbeat_keys_;

  std::size_t deliveries_in_flight_ = 0;

  microseconds last_heard_{0};
  bool silence_reported_ = false;
  microseconds next_silence_report_{0};

  double mean_job_us_ = -1;                 // moving average; negative: unknown
  double mean_answer_us_ = 0;               // moving average of the time between requesting and receiving jobs
  std::optional<microseconds> idle_since_;  // time since which no job is held, except for delivery
  bool stop_requested_ = false;
  bool draining_ = false;  // no new jobs
  microseconds drain_end_ = microseconds::max();
  microseconds stop_end_ = microseconds::max();  // time by which the first order is carried out
  bool jobs_released_ = false;                   // running jobs were released; only deliveries are left
  bool killing_ = false;
  bool finished_ = false;
  ExitCode exit_code_ = ExitCode::kOk;
  microseconds delivering_since_{0};  // time since which only deliveries are left
};

}  // namespace legopt::worker
