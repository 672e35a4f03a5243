#pragma once

#include <poll.h>

#include <chrono>
#include <deque>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "bus/codec.h"
#include "legopt/types/reply.h"
#include "tests/worker/misbehaviour.h"
#include "tests/worker/sample_messages.h"
#include "worker/pool.h"
#include "worker/server_link.h"

namespace legopt::worker {

/// A server inside the test's process: leases the queued jobs, keeps the results, and re-queues released jobs, which a
/// worker on a busy machine may release. Real clock, no network.
class FakeServer final : public ServerLink {
 public:
  /// Adds a job with this misbehaviour; returns its id.
  std::int64_t Queue(Misbehaviour what, microseconds wall_limit = std::chrono::seconds(60),
                     std::int64_t memory_limit_bytes = std::int64_t{256} << 20) {
    legopt_msg::lease lease = SampleLease(next_id_++);
    lease.problem_id = static_cast<int>(what);
    lease.wall_limit_us = wall_limit.count();
    lease.memory_limit_bytes = memory_limit_bytes;
    queue_.push_back(lease);
    ++num_jobs_;
    return lease.job_id;
  }

  std::size_t num_queued() const { return queue_.size(); }
  bool all_done() const { return results.size() == num_jobs_; }

  microseconds now() const override {
    return std::chrono::duration_cast<microseconds>(std::chrono::steady_clock::now().time_since_epoch());
  }

  void Call(bus::MessageType type, std::string body, microseconds /*timeout*/,
            std::function<void(bus::CallResult&&)> callback) override {
    bus::CallResult result;
    result.status = bus::CallResult::kOk;
    result.body = Answer(type, body);
    pending_.emplace_back(std::move(callback), std::move(result));
  }

  void Wait(std::span<pollfd> extra, microseconds max_wait) override {
    if (on_wait) on_wait();
    const auto answers = std::exchange(pending_, {});
    for (const auto& [callback, result] : answers) callback(bus::CallResult(result));
    const auto milliseconds = std::chrono::ceil<std::chrono::milliseconds>(max_wait).count();
    poll(extra.data(), extra.size(), answers.empty() ? static_cast<int>(milliseconds) : 0);
  }

  std::map<std::int64_t, legopt_msg::result_request> results;  ///< job id -> result, without released jobs
  std::vector<legopt_msg::result_request> given_back;
  std::map<std::int64_t, legopt_msg::lease> leases;  ///< job id -> its last lease
  std::map<std::int64_t, LeaseVerdict> verdicts;     ///< sent in heartbeats, by job id; kContinue if absent
  std::function<void()> on_wait;

 private:
  std::string Answer(bus::MessageType type, const std::string& body) {
    switch (type) {
      case bus::MessageType::kHello: {
        legopt_msg::hello_reply reply{};
        reply.server_instance = 1;
        reply.worker_id = 1;
        reply.lease_us = 10'000'000;
        reply.heartbeat_us = 50'000;
        return bus::Encode(reply);
      }
      case bus::MessageType::kLease:
        return bus::Encode(Lease(bus::Decode<legopt_msg::lease_request>(body).value()));
      case bus::MessageType::kHeartbeat: {
        const auto request = bus::Decode<legopt_msg::heartbeat_request>(body).value();
        legopt_msg::heartbeat_reply reply{};
        reply.server_instance = 1;
        for (const auto& lease : request.leases) {
          const auto verdict = verdicts.find(lease.job_id);
          reply.verdicts.push_back(
              static_cast<std::int8_t>(verdict == verdicts.end() ? LeaseVerdict::kContinue : verdict->second));
        }
        return bus::Encode(reply);
      }
      case bus::MessageType::kMethod: {
        legopt_msg::method_reply reply{};
        reply.options_json = "{}";
        return bus::Encode(reply);
      }
      default: {
        legopt_msg::result_reply reply{};
        const bool kept = Keep(bus::Decode<legopt_msg::result_request>(body).value());
        reply.status = static_cast<std::int32_t>(kept ? ResultStatus::kAccepted : ResultStatus::kDuplicate);
        return bus::Encode(reply);
      }
    }
  }

  // Returns false for a result that exists already.
  bool Keep(const legopt_msg::result_request& result) {
    const bool is_given_back =
        result.outcome == static_cast<int>(ReportedOutcome::kCancelled) && !verdicts.contains(result.job_id);
    if (!is_given_back) return results.emplace(result.job_id, result).second;
    legopt_msg::lease& lease = leases.at(result.job_id);
    if (lease.token != result.token) return false;
    given_back.push_back(result);
    ++lease.attempt;
    lease.token += kTokensPerAttempt;
    queue_.push_back(lease);
    return true;
  }

  legopt_msg::lease_reply Lease(const legopt_msg::lease_request& request) {
    legopt_msg::lease_reply reply{};
    for (int i = 0; i < request.max_jobs && !queue_.empty(); ++i) {
      leases[queue_.front().job_id] = queue_.front();
      reply.jobs.push_back(queue_.front());
      queue_.pop_front();
    }
    if (reply.jobs.empty()) {
      reply.status = static_cast<std::int32_t>(all_done() ? LeaseStatus::kNoMoreWork : LeaseStatus::kNoneNow);
      reply.retry_after_us = 10'000;
    }
    return reply;
  }

  static constexpr std::int64_t kTokensPerAttempt = 1'000'000;
  std::int64_t next_id_ = 1;
  std::size_t num_jobs_ = 0;
  std::deque<legopt_msg::lease> queue_;
  std::vector<std::pair<std::function<void(bus::CallResult&&)>, bus::CallResult>> pending_;
};

/// Returns options for a supervisor on a FakeServer, which leaves when all jobs are done.
inline PoolOptions TestPoolOptions(int slots) {
  PoolOptions options;
  options.slots = slots;
  options.name = "test";
  options.hostname = "host";
  options.pid = 1;
  options.build = "test";
  options.build_id = "test";
  options.exit_when_idle = true;
  options.slot_times.kill_grace = std::chrono::milliseconds(100);
  return options;
}

}  // namespace legopt::worker
