#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "legopt/types/reply.h"
#include "tests/worker/sample_messages.h"
#include "worker/pool.h"

namespace legopt::worker {

inline PoolOptions WithSlots(int slots) {
  PoolOptions options;
  options.slots = slots;
  return options;
}

/// A Pool in virtual time: collects its actions and simulates server and job processes on request.
class PoolHarness {
 public:
  /// Drops the first hello, which the pool sends before it has datasets.
  explicit PoolHarness(PoolOptions options = {}) : pool(Named(std::move(options)), now) {
    Collect();
    Take<CallHello>();
    pool.OnHelloReply(now, nullptr, "no answer");
  }

  static PoolOptions Named(PoolOptions options) {
    options.name = "test";
    options.hostname = "host";
    options.pid = 42;
    options.build = "test build";
    options.build_id = "test";
    options.server_address = "239.0.0.1:7667";
    return options;
  }

  void Advance(microseconds duration) {
    now += duration;
    pool.Tick(now);
    Collect();
  }

  /// Advances to each deadline in turn, until `duration` has passed.
  void Run(microseconds duration) {
    const microseconds end = now + duration;
    while (pool.next_deadline() < end) {
      now = std::max(now, pool.next_deadline());
      pool.Tick(now);
      Collect();
    }
    now = end;
    pool.Tick(now);
    Collect();
  }

  void Collect() {
    for (Action& action : pool.TakeActions()) {
      if (auto* exit = std::get_if<ExitWorker>(&action)) exit_code = exit->code;
      if (auto* line = std::get_if<LogLine>(&action)) log += line->text + "\n";
      actions.push_back(std::move(action));
    }
  }

  /// Removes and returns the actions of one kind since the last Take of that kind.
  template <class Kind>
  std::vector<Kind> Take() {
    std::vector<Kind> taken;
    std::erase_if(actions, [&](const Action& action) {
      if (const Kind* found = std::get_if<Kind>(&action)) {
        taken.push_back(*found);
        return true;
      }
      return false;
    });
    return taken;
  }

  void ChildrenReady() {
    for (const StartChild& start : Take<StartChild>()) {
      pool.OnChildReady(now, start.slot, {{"garage", HexHash('d')}});
    }
    Collect();
  }

  void ReplyHello(std::int64_t worker_id = 7, std::int64_t instance = 1) {
    legopt_msg::hello_reply reply{};
    reply.server_instance = instance;
    reply.worker_id = worker_id;
    reply.lease_us = 10'000'000;
    reply.heartbeat_us = 1'000'000;
    pool.OnHelloReply(now, &reply, "");
    Collect();
  }

  void ReplyLease(const std::vector<legopt_msg::lease>& leases, std::optional<LeaseStatus> status = {},
                  std::int64_t retry_us = 100'000) {
    legopt_msg::lease_reply reply{};
    if (!status) status = leases.empty() ? LeaseStatus::kNoneNow : LeaseStatus::kLeased;
    reply.status = static_cast<std::int32_t>(*status);
    reply.retry_after_us = retry_us;
    reply.message = status == LeaseStatus::kDatasetMismatch ? "jobs need dataset garage " + HexHash('f') : "";
    reply.wanted_dataset = wanted_dataset;
    reply.jobs = leases;
    reply.num_jobs = static_cast<std::int32_t>(leases.size());
    pool.OnLeaseReply(now, &reply, "");
    Collect();
  }

  std::string wanted_dataset;  // sent with each lease reply

  void ReplyMethod(const std::string& hash, MethodStatus status = MethodStatus::kFound) {
    legopt_msg::method_reply reply{};
    reply.status = static_cast<std::int32_t>(status);
    reply.options_json = status == MethodStatus::kFound ? "{}" : "";
    pool.OnMethodReply(now, hash, &reply, "");
    Collect();
  }

  /// Answers the newest heartbeat with one verdict for all its leases.
  void ReplyHeartbeat(LeaseVerdict verdict = LeaseVerdict::kContinue, HeartbeatStatus status = HeartbeatStatus::kOk,
                      std::int64_t instance = 1) {
    const std::vector<CallHeartbeat> calls = Take<CallHeartbeat>();
    ASSERT_FALSE(calls.empty());
    legopt_msg::heartbeat_reply reply{};
    reply.server_instance = instance;
    reply.status = static_cast<std::int32_t>(status);
    reply.verdicts.assign(calls.back().request.leases.size(), static_cast<std::int8_t>(verdict));
    reply.num_leases = static_cast<std::int32_t>(reply.verdicts.size());
    pool.OnHeartbeatReply(now, &reply, "");
    Collect();
  }

  void ReplyResult(const LeaseKey& key, ResultStatus status = ResultStatus::kAccepted) {
    legopt_msg::result_reply reply{};
    reply.status = static_cast<std::int32_t>(status);
    pool.OnResultReply(now, key, &reply, "");
    Collect();
  }

  void FinishJob(const AssignJob& job) {
    pool.OnChildResult(now, job.slot, job.sequence, ResultWithoutSolution(ReportedOutcome::kFinished, "done"));
    Collect();
  }

  void Exit(int slot, const ChildExit& exit) {
    pool.OnChildExited(now, slot, exit);
    Collect();
  }

  /// Makes the pool ready and registered, with the given jobs running or waiting; takes all actions so far except the
  /// assignments.
  void StartJobs(const std::vector<legopt_msg::lease>& leases) {
    ChildrenReady();
    Take<CallHello>();
    ReplyHello();
    Take<CallLease>();
    ReplyLease(leases);
    for (const CallMethod& call : Take<CallMethod>()) ReplyMethod(call.request.hash);
  }

  microseconds now{1'000'000};
  Pool pool;
  std::vector<Action> actions;
  std::string log;
  std::optional<ExitCode> exit_code;
};

}  // namespace legopt::worker
