#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bus/messages.h"
#include "server/scheduler.h"
#include "tests/doubles/memory_store.h"
#include "tests/server/reply_status.h"
#include "tests/server/sample_spec.h"

namespace legopt::server {

inline legopt_msg::result_request ResultFor(std::int64_t worker_id, const legopt_msg::lease& lease,
                                            ReportedOutcome outcome = ReportedOutcome::kFinished) {
  legopt_msg::result_request result{};
  result.worker_id = worker_id;
  result.job_id = lease.job_id;
  result.attempt = lease.attempt;
  result.token = lease.token;
  result.outcome = EnumNumber(outcome);
  result.failed_waypoint = -1;
  if (outcome != ReportedOutcome::kFinished) return result;
  result.solver_status = "converged_feasible";
  result.wall_us = 2000;
  result.verdict_literal = "success";
  result.verdict_strict = "success";
  result.verdict_solid = result.verdict_physical = "success";
  result.cost = static_cast<double>(lease.job_id) + lease.attempt / 100.0;  // identifies the attempt of a result
  result.num_waypoints = 1;
  result.waypoint_size = 2;
  result.waypoints = {1.0, 2.0};
  result.num_values = 2;
  return result;
}

/// A scheduler on a memory store in virtual time. Every message is committed at once.
class SchedulerTest : public testing::Test {
 protected:
  static constexpr bus::EndpointId kFirst = 1001, kSecond = 1002;

  SchedulerTest() { Restart(); }

  /// Restarts the scheduler as after kill -9: only the store remains.
  void Restart() {
    options_.server_instance = ++instance_;
    scheduler_ = std::make_unique<Scheduler>(
        options_, store_.LoadOpenState(), [this] { return ++token_; },
        Scheduler::Lookup{[this](std::int64_t job, int attempt) { return store_.FindAttempt(job, attempt); },
                          [this](const std::string& hash) { return store_.FindMethodOptions(hash); },
                          [this](std::int64_t id) { return store_.LoadExperiment(id); },
                          [this](const db::ResultSearch& search) {
                            if (reads_fail_) throw db::StoreError(db::StoreErrorCode::kIo, "injected fault");
                            return store_.FindKnownResults(search);
                          },
                          [this] { return disk_; }},
        now_);
  }

  void Commit() {
    store_.Apply(ops_);
    ops_.clear();
  }

  void Advance(microseconds duration) {
    now_.steady += duration;
    now_.wall_us += duration.count();
    scheduler_->Tick(now_, ops_);
    Commit();
  }

  legopt_msg::submit_reply Submit(const nlohmann::json& spec, const std::string& id = "s1") {
    legopt_msg::submit_request request{};
    request.submission_id = id;
    request.spec_json = spec.dump();
    const auto reply = scheduler_->Submit(now_, request, ops_);
    Commit();
    return reply;
  }

  static legopt_msg::capability CapabilityOf(const std::string& kind, const std::string& name,
                                             const std::string& hash) {
    legopt_msg::capability capability{};
    capability.kind = kind;
    capability.name = name;
    capability.hash = hash;
    return capability;
  }

  static legopt_msg::hello_request HelloRequest(bus::EndpointId endpoint, int slots = 1, char dataset_digit = 'd',
                                                const std::string& dataset = "garage") {
    legopt_msg::hello_request request{};
    request.protocol_version = bus::kProtocolVersion;
    request.worker_name = "worker-" + std::to_string(endpoint);
    request.pid = 1;
    request.slots = slots;
    request.capabilities = {CapabilityOf("dataset", dataset, HashOf(dataset_digit))};
    return request;
  }

  legopt_msg::hello_reply Hello(bus::EndpointId endpoint, int slots = 1, char dataset_digit = 'd',
                                const std::string& dataset = "garage") {
    const auto request = HelloRequest(endpoint, slots, dataset_digit, dataset);
    const auto reply = scheduler_->Hello(now_, endpoint, request, ops_);
    Commit();
    worker_ids_[endpoint] = reply.worker_id;
    return reply;
  }

  /// Registers a worker that is still loading its dataset.
  legopt_msg::hello_reply HelloWithoutDataset(bus::EndpointId endpoint, int slots = 1) {
    legopt_msg::hello_request request{};
    request.protocol_version = bus::kProtocolVersion;
    request.worker_name = "worker-" + std::to_string(endpoint);
    request.pid = 1;
    request.slots = slots;
    const auto reply = scheduler_->Hello(now_, endpoint, request, ops_);
    Commit();
    worker_ids_[endpoint] = reply.worker_id;
    return reply;
  }

  legopt_msg::lease_reply Lease(bus::EndpointId endpoint, int max_jobs = 1) {
    legopt_msg::lease_request request{};
    request.worker_id = worker_ids_[endpoint];
    request.server_instance = options_.server_instance;
    request.max_jobs = max_jobs;
    const auto reply = scheduler_->Lease(now_, endpoint, request, ops_);
    Commit();
    return reply;
  }

  legopt_msg::lease LeaseOne(bus::EndpointId endpoint) {
    const auto reply = Lease(endpoint);
    EXPECT_EQ(reply.jobs.size(), 1U) << reply.message;
    return reply.jobs.empty() ? legopt_msg::lease{} : reply.jobs[0];
  }

  legopt_msg::heartbeat_reply Heartbeat(bus::EndpointId endpoint, const std::vector<legopt_msg::lease>& leases) {
    legopt_msg::heartbeat_request request{};
    request.worker_id = worker_ids_[endpoint];
    request.server_instance = options_.server_instance;
    for (const legopt_msg::lease& lease : leases) {
      legopt_msg::lease_state state{};
      state.job_id = lease.job_id;
      state.attempt = lease.attempt;
      state.token = lease.token;
      request.leases.push_back(state);
    }
    return scheduler_->Heartbeat(now_, endpoint, request);
  }

  legopt_msg::heartbeat_reply HeartbeatWithProgress(bus::EndpointId endpoint, const legopt_msg::lease& lease,
                                                    std::int64_t done, std::int64_t total) {
    legopt_msg::heartbeat_request request{};
    request.worker_id = worker_ids_[endpoint];
    request.server_instance = options_.server_instance;
    legopt_msg::lease_state state{};
    state.job_id = lease.job_id;
    state.attempt = lease.attempt;
    state.token = lease.token;
    state.progress_done = done;
    state.progress_total = total;
    request.leases = {state};
    return scheduler_->Heartbeat(now_, endpoint, request);
  }

  legopt_msg::result_reply Deliver(const legopt_msg::result_request& result) {
    const auto reply = scheduler_->Result(now_, result, ops_);
    Commit();
    return reply;
  }
  legopt_msg::result_reply Finish(bus::EndpointId endpoint, const legopt_msg::lease& lease,
                                  ReportedOutcome outcome = ReportedOutcome::kFinished) {
    return Deliver(ResultFor(worker_ids_[endpoint], lease, outcome));
  }

  legopt_msg::cancel_reply Cancel(std::int64_t experiment_id) {
    legopt_msg::cancel_request request{};
    request.experiment_id = experiment_id;
    const auto reply = scheduler_->Cancel(now_, request, ops_);
    Commit();
    return reply;
  }

  legopt_msg::control_reply Control(std::int64_t experiment_id, ControlAction action, const std::string& reason = "",
                                    int priority = 0) {
    legopt_msg::control_request request{};
    request.experiment_id = experiment_id;
    request.action = EnumNumber(action);
    request.reason = reason;
    request.priority = priority;
    const auto reply = scheduler_->Control(now_, request, ops_);
    Commit();
    return reply;
  }

  db::JobState StateOf(std::int64_t job_id) { return store_.job_state(job_id).value(); }
  const db::ExperimentSummary& Summary(std::int64_t id = 1) { return scheduler_->experiments().at(id); }

  SchedulerOptions options_;
  db::MemoryStore store_;
  std::unique_ptr<Scheduler> scheduler_;
  Scheduler::Ops ops_;
  Instant now_{microseconds(1'000'000), 1'700'000'000'000'000};
  bool reads_fail_ = false;            // simulates read errors of known results
  std::optional<db::DiskSpace> disk_;  // disk of the database; empty: unknown
  std::int64_t instance_ = 500;
  std::int64_t token_ = 9000;
  std::map<bus::EndpointId, std::int64_t> worker_ids_;
};

}  // namespace legopt::server
