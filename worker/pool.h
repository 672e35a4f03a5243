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

#include "legopt_msg/heartbeat_reply.hpp"
#include "legopt_msg/hello_reply.hpp"
#include "legopt_msg/lease_reply.hpp"
#include "legopt_msg/method_reply.hpp"
#include "legopt_msg/result_reply.hpp"
#include "words/task.h"
#include "worker/actions.h"
#include "worker/job_executor.h"
#include "worker/job_slot.h"

namespace legopt::worker {

struct PoolOptions {
  int slots = 1;  ///< >= 1
  std::string name;
  std::string hostname;
  std::int64_t pid = 0;
  std::string build;                                  ///< for people
  std::string build_id;                               ///< 1 .. 64 bytes; equal for builds that compute the same bits
  std::string processor;                              ///< model of the host's
  std::int32_t processors = 1;                        ///< granted, >= 1
  std::int64_t memory_bytes = 0;                      ///< of the host; 0: unknown
  std::function<double()> load = [] { return 0.0; };  ///< of the host, now; NaN: unknown
  std::int32_t protocol_version = 1;
  std::string server_address;   ///< for messages: "GROUP:PORT", or all addresses that a bridge tries
  bool bridged = false;         ///< for messages: a bridge leads there
  std::string key_file;         ///< for messages; empty: the deployment has no key
  bool fetch_datasets = false;  ///< end without jobs to fetch a dataset that the server wants fetched: see Pool
  std::vector<std::string> unfetched = {};  ///< content hashes of datasets that could not be fetched or loaded
  bool exit_when_idle = false;              ///< leave when the server says that there is no more work (PROTOCOL.md, 9)
  /// Leave with ExitCode::kUnreachable after this long without any word from the server; max(): keep trying.
  microseconds wait_server = microseconds::max();
  SlotTimes slot_times;
  /// Work to hold ready per slot, so that short jobs need not wait for the network: leases are fetched ahead for this
  /// much of the average job's duration. Long jobs are not fetched ahead: an idle slot elsewhere may take them.
  /// The slower the server's answers, the more: four times what they take, at most `longest_prefetch`.
  microseconds prefetch = std::chrono::milliseconds(60);
  microseconds longest_prefetch = std::chrono::milliseconds(250);
  int max_prefetch_per_slot = 64;
  /// A lease held ready for longer, because the jobs before it took longer than those that the estimate was made from,
  /// is given back: another worker may have an idle slot.
  microseconds longest_ready = std::chrono::seconds(2);
  /// Leave when there has been no job for this long, server or not; counted from when the first process is ready.
  microseconds idle_timeout = microseconds::max();
  /// How long running jobs may go on after the first order to stop; then they are given back. Less than what docker
  /// leaves a container between TERM and KILL (10 s; Slurm and Kubernetes 30 s): a job that is killed costs an attempt,
  /// one that is given back only its time.
  microseconds drain = std::chrono::seconds(8);
  /// How long the last results are offered to a silent server: when the jobs are over, and after the second order. A
  /// worker that receives a signal to stop ends 9.5 s after that at the latest, or 1.5 s after a longer drain.
  microseconds delivery_limit = std::chrono::seconds(15);
  microseconds kill_limit = std::chrono::seconds(1);
  std::uint64_t seed = 1;  ///< of the jitter on waiting times; workers should differ
};

/// Everything a worker decides: registration, leases, what runs where, when a job must stop, and which results are
/// still to be delivered. A pure state machine: events with their time go in, actions come out (TakeActions); it owns
/// no process, socket or clock. Time is steady, since an arbitrary start, and never goes back.
///
/// Promises:
///  - a lease counts from before it was asked for; its job is stopped a tenth of the lease before it could end
///  unrenewed;
///  - a result is offered until the server has answered it, over any restart of the server;
///  - heartbeats cover running jobs, leases held ready, and results under way;
///  - jobs begin in the order of their leases; those held ready are few, and are given back when they would wait long;
///  - whatever a job process does costs one attempt of the job it had, and nothing else;
///  - only datasets that a job process has loaded and hashed are announced, and only their jobs are accepted;
///  - with `fetch_datasets`, a pool without jobs and leases ends when the server names a dataset to fetch. Its
///  surroundings fetch that and start another pool, for which the server takes it as the same worker.
///
/// One thread.
class Pool {
 public:
  Pool(PoolOptions options, microseconds now);

  // --- From the job processes -------------------------------------------------------------------------------------
  /// `capabilities`: what it has loaded; at least one dataset.
  void OnChildReady(microseconds now, int slot, const std::vector<Capability>& capabilities);
  /// The process says that its datasets cannot be used, and why; its exit follows.
  void OnChildStartFailed(microseconds now, int slot, const std::string& message);
  void OnChildProgress(microseconds now, int slot, std::uint64_t sequence, int done, int total);
  void OnChildJudging(microseconds now, int slot, std::uint64_t sequence);
  void OnChildResult(microseconds now, int slot, std::uint64_t sequence, legopt_msg::result_request result);
  void OnChildGarbage(microseconds now, int slot, const std::string& why);
  void OnChildExited(microseconds now, int slot, const ChildExit& exit);

  // --- From the server; a null reply means time-out or refusal, then `error` says what ------------------------------
  void OnHelloReply(microseconds now, const legopt_msg::hello_reply* reply, const std::string& error);
  void OnLeaseReply(microseconds now, const legopt_msg::lease_reply* reply, const std::string& error);
  void OnHeartbeatReply(microseconds now, const legopt_msg::heartbeat_reply* reply, const std::string& error);
  void OnMethodReply(microseconds now, const std::string& hash, const legopt_msg::method_reply* reply,
                     const std::string& error);
  void OnResultReply(microseconds now, const LeaseKey& key, const legopt_msg::result_reply* reply,
                     const std::string& error);

  /// The server refused a call because of the role of this worker's key; before the call's own reply.
  void OnKeyRefused(microseconds now, const std::string& error);

  // --- From outside -----------------------------------------------------------------------------------------------
  /// First call: take no more jobs, give back what has not begun, finish and deliver the rest, what still runs after
  /// `drain` excepted: it is killed and given back. Leave with ExitCode::kOk. Second: kill what runs, give it back,
  /// leave with ExitCode::kInterrupted. Third: leave at once.
  void Stop(microseconds now);
  /// Does what time demands. To be called at the latest at next_deadline().
  void Tick(microseconds now);

  /// max() when only an event can change anything.
  microseconds next_deadline() const;
  /// What is to be done, in order; empties the list.
  std::vector<Action> TakeActions();

  bool registered() const { return registration_.has_value(); }
  /// Leases held: ready, running, and delivering.
  std::size_t num_leases() const { return leases_.size(); }
  std::size_t num_running() const;
  std::size_t num_undelivered() const;

  /// Content hash of the dataset that the pool ended for, which the next pool should have; empty: it ended otherwise.
  const std::string& ended_to_fetch() const { return ended_to_fetch_; }
  /// A job process has loaded its datasets.
  bool has_loaded() const { return !capabilities_.empty(); }

  /// Limits of the calls that the surroundings make for a pool; the heartbeat's is its interval.
  microseconds lease_call_timeout() const;
  microseconds heartbeat_interval() const;

 private:
  static constexpr double kAverageWeight = 0.2;  // of the newest value in a moving average
  enum class Phase { kReady, kRunning, kDelivering };
  struct HeldLease {
    legopt_msg::lease lease;
    Task task{};
    Phase phase = Phase::kReady;
    microseconds expires{0};   // when its job must have been stopped
    microseconds accepted{0};  // when it was received
    std::int64_t progress_done = 0;
    std::int64_t progress_total = 0;
    // Delivery:
    std::shared_ptr<const legopt_msg::result_request> result;
    bool in_flight = false;
    microseconds next_delivery{0};
    microseconds delivery_backoff{0};
  };
  struct MethodEntry {
    std::shared_ptr<const std::string> options_json;  // null while asked for
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
  void TellOnce(const std::string& server_message);
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
  void GiveBackRunning();
  void SayGoodbye();
  void Finish(ExitCode exit_code);
  void DrainForServer(microseconds now);
  std::string CausesOfSilence() const;

  // pool_jobs.cpp: slots, results
  void AdvanceSlots(microseconds now);
  void Carry(int slot, JobSlot::Command command);
  void Dispatch(microseconds now);
  std::size_t NumIn(Phase phase) const;
  bool CanDeliver() const;
  void DeliverResults(microseconds now);
  void EndStoppedJob(microseconds now, const LeaseKey& key, StopReason reason);
  void EndKilledJob(microseconds now, const SlotEntry& slot, const ChildExit& exit);
  bool EndedWithTheWorker(const JobSlot& machine, const ChildExit& exit) const;
  void KeepResult(microseconds now, const LeaseKey& key, legopt_msg::result_request result);
  void FailLease(microseconds now, const LeaseKey& key, const std::string& message);
  void RefuseLease(microseconds now, const LeaseKey& key, const std::string& message);
  void GiveBackReady(microseconds now);
  void GiveBackWaiting(microseconds now);
  std::optional<microseconds> WaitEnd() const;
  void StopLease(microseconds now, const LeaseKey& key, StopReason reason);
  void NoteDuration(microseconds duration);
  void CheckStarts(const ChildExit& last);

  PoolOptions options_;
  std::vector<SlotEntry> slots_;
  std::vector<Action> actions_;
  std::map<LeaseKey, HeldLease> leases_;
  std::deque<LeaseKey> ready_;  // leases without a slot yet, in the order of their leases
  std::map<std::string, MethodEntry> methods_;

  std::vector<Capability> capabilities_;  // as announced; empty until the first process is ready
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
  std::string told_;  // the last message of the server that was logged
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
  double mean_answer_us_ = 0;               // likewise, between asking for jobs and having them
  std::optional<microseconds> idle_since_;  // no job held but for its delivery
  bool told_to_stop_ = false;
  bool draining_ = false;  // no new jobs
  microseconds drain_end_ = microseconds::max();
  microseconds stop_end_ = microseconds::max();  // the first order is carried out by then
  bool gave_back_ = false;                       // what ran: only deliveries are left
  bool killing_ = false;
  bool finished_ = false;
  ExitCode exit_code_ = ExitCode::kOk;
  microseconds delivering_since_{0};  // since when nothing is left but to deliver
};

}  // namespace legopt::worker
