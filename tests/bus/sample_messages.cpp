#include "tests/bus/sample_messages.h"

#include <cmath>
#include <cstring>
#include <string>

namespace legopt::bus {
namespace {

const std::string kHash(64, 'a');
constexpr std::int64_t kInstance = 0x1234567890ABCDEF;
constexpr std::int64_t kToken = -77;

}  // namespace

template <>
legopt_msg::frame Sample() {
  legopt_msg::frame m{};
  m.version = 1;
  m.kind = 2;
  m.type = 3;
  m.code = 0;
  m.deployment = -5;
  m.sender = 6;
  m.destination = 7;
  m.session = 8;
  m.call_id = 10;
  m.completed_below = 9;
  m.nonce = 11;
  for (std::size_t i = 0; i < sizeof(m.tag); ++i) m.tag[i] = static_cast<std::uint8_t>(i);
  m.payload = {1, 2, 3, 250};
  m.payload_bytes = 4;
  return m;
}
template <>
legopt_msg::chunk Sample() {
  legopt_msg::chunk m{};
  m.total_bytes = 1024 + 5;
  std::memset(m.hash, 0x5A, sizeof(m.hash));
  m.index = 1;
  m.ack_requested = 1;
  m.data = {9, 8, 7, 6, 5};
  m.data_bytes = 5;
  return m;
}
template <>
legopt_msg::chunk_ack Sample() {
  legopt_msg::chunk_ack m{};
  m.of_reply = 1;
  m.complete = 0;
  m.reassembly = kInstance;
  m.received_below = 12;
  m.received_mask = -2;
  m.credit = 32;
  return m;
}
template <>
legopt_msg::probe_request Sample() {
  legopt_msg::probe_request m{};
  m.nonce = -1;
  return m;
}
template <>
legopt_msg::probe_reply Sample() {
  legopt_msg::probe_reply m{};
  m.protocol_version = 1;
  m.server_version = "0.1.0";
  m.hostname = "b\xC3\xBCro";
  m.pid = 4321;
  m.server_instance = kInstance;
  m.database = "/home/someone/results.sqlite";
  m.uptime_us = 5;
  m.wall_clock_us = 1'700'000'000'000'000;
  return m;
}
template <>
legopt_msg::dataset_ref Sample() {
  legopt_msg::dataset_ref m{};
  m.name = "garage-small";
  m.hash = kHash;
  return m;
}
template <>
legopt_msg::hello_request Sample() {
  legopt_msg::hello_request m{};
  m.protocol_version = 1;
  m.worker_name = "w1";
  m.hostname = "host";
  m.pid = 1;
  m.slots = 2;
  m.build = "0.1.0 g++ 12";
  m.datasets = {Sample<legopt_msg::dataset_ref>(), Sample<legopt_msg::dataset_ref>()};
  m.num_datasets = 2;
  return m;
}
template <>
legopt_msg::hello_reply Sample() {
  legopt_msg::hello_reply m{};
  m.status = 0;
  m.server_instance = kInstance;
  m.worker_id = 3;
  m.lease_us = 10'000'000;
  m.heartbeat_us = 1'000'000;
  m.message = "welcome";
  return m;
}
template <>
legopt_msg::lease_request Sample() {
  legopt_msg::lease_request m{};
  m.worker_id = 3;
  m.server_instance = kInstance;
  m.slot = 1;
  m.max_jobs = 4;
  m.dataset_hashes = {kHash, kHash};
  m.num_datasets = 2;
  return m;
}
template <>
legopt_msg::lease Sample() {
  legopt_msg::lease m{};
  m.job_id = 11;
  m.experiment_id = 2;
  m.attempt = 1;
  m.token = kToken;
  m.lease_us = 10'000'000;
  m.dataset_hash = kHash;
  m.method_hash = kHash;
  m.task = "posture";
  m.initialization = "in_collision";
  m.problem_id = 0;
  m.repetition = 0;
  m.experiment_seed = -9;
  m.wall_limit_us = 60'000'000;
  m.memory_limit_bytes = 1 << 30;
  return m;
}
template <>
legopt_msg::lease_reply Sample() {
  legopt_msg::lease_reply m{};
  m.status = 0;
  m.retry_after_us = 0;
  m.message = "";
  m.jobs = {Sample<legopt_msg::lease>(), Sample<legopt_msg::lease>()};
  m.num_jobs = 2;
  return m;
}
template <>
legopt_msg::method_request Sample() {
  legopt_msg::method_request m{};
  m.hash = kHash;
  return m;
}
template <>
legopt_msg::method_reply Sample() {
  legopt_msg::method_reply m{};
  m.status = 0;
  m.options_json = R"({"solver":"sqp"})";
  return m;
}
template <>
legopt_msg::lease_state Sample() {
  legopt_msg::lease_state m{};
  m.job_id = 11;
  m.attempt = 1;
  m.token = kToken;
  m.progress_done = 3;
  m.progress_total = 10;
  return m;
}
template <>
legopt_msg::heartbeat_request Sample() {
  legopt_msg::heartbeat_request m{};
  m.worker_id = 3;
  m.server_instance = kInstance;
  m.leases = {Sample<legopt_msg::lease_state>(), Sample<legopt_msg::lease_state>()};
  m.num_leases = 2;
  return m;
}
template <>
legopt_msg::heartbeat_reply Sample() {
  legopt_msg::heartbeat_reply m{};
  m.server_instance = kInstance;
  m.status = 0;
  m.verdicts = {0, 1, 2};
  m.num_leases = 3;
  return m;
}
template <>
legopt_msg::result_request Sample() {
  legopt_msg::result_request m{};
  m.worker_id = 3;
  m.job_id = 11;
  m.attempt = 1;
  m.token = kToken;
  m.outcome = 0;
  m.message = "done";
  m.log_tail = "last line\n";
  m.exit_signal = 0;
  m.solver_status = "converged_feasible";
  m.iterations = 17;
  m.restarts = 0;
  m.wall_us = 1500;
  m.cpu_us = 1400;
  m.involuntary_context_switches = 1;
  m.peak_memory_bytes = 30 << 20;
  m.solver_cost = 391.5;
  m.solver_violation = 1e-6;
  m.verdict_literal = "success";
  m.verdict_strict = "self_collision";
  m.verdict_detail = "left forearm in pelvis by 2 mm";
  m.failed_waypoint = -1;
  m.cost = 391.25;
  m.foot_violation = 1e-4;
  m.com_violation_m = 0;
  m.limit_violation = 0;
  m.environment_depth_m = 0;
  m.self_depth_literal_m = 0;
  m.self_depth_strict_m = 0.002;
  m.interpolation_environment_depth_m = 0.004;
  m.interpolation_self_depth_m = 0;
  m.interpolation_free_share = 0.75;
  m.windows = 3;
  m.windows_solved = 2;
  m.num_waypoints = 2;
  m.waypoint_size = 3;
  m.waypoints = {1, -2, 3.5, 0, -0.0, 1e300};
  m.num_values = 6;
  m.history_json = "[]";
  return m;
}
template <>
legopt_msg::result_reply Sample() {
  legopt_msg::result_reply m{};
  m.status = 2;
  m.message = "stale";
  return m;
}
template <>
legopt_msg::submit_request Sample() {
  legopt_msg::submit_request m{};
  m.submission_id = "0123-4567";
  m.spec_json = "{}";
  return m;
}
template <>
legopt_msg::submit_reply Sample() {
  legopt_msg::submit_reply m{};
  m.status = 0;
  m.experiment_id = 1;
  m.num_jobs = 40;
  m.message = "created";
  return m;
}
template <>
legopt_msg::status_request Sample() {
  legopt_msg::status_request m{};
  m.experiment_id = 0;
  return m;
}
template <>
legopt_msg::status_reply Sample() {
  legopt_msg::status_reply m{};
  m.json = R"({"experiments":[]})";
  return m;
}
template <>
legopt_msg::query_request Sample() {
  legopt_msg::query_request m{};
  m.sql = "SELECT 1";
  m.max_rows = 100;
  return m;
}
template <>
legopt_msg::query_reply Sample() {
  legopt_msg::query_reply m{};
  m.status = 0;
  m.message = "";
  m.json = R"({"columns":["1"],"rows":[[1]],"truncated":false})";
  return m;
}
template <>
legopt_msg::cancel_request Sample() {
  legopt_msg::cancel_request m{};
  m.experiment_id = 1;
  return m;
}
template <>
legopt_msg::cancel_reply Sample() {
  legopt_msg::cancel_reply m{};
  m.status = 0;
  m.num_jobs = 3;
  m.message = "cancelled";
  return m;
}
template <>
legopt_msg::control_request Sample() {
  legopt_msg::control_request m{};
  m.experiment_id = 1;
  m.action = 2;
  m.reason = "the disk is being moved";
  return m;
}
template <>
legopt_msg::control_reply Sample() {
  legopt_msg::control_reply m{};
  m.status = 0;
  m.num_jobs = 3;
  m.message = "held";
  return m;
}
template <>
legopt_msg::shutdown_request Sample() {
  legopt_msg::shutdown_request m{};
  m.nonce = 1;
  return m;
}
template <>
legopt_msg::shutdown_reply Sample() {
  legopt_msg::shutdown_reply m{};
  m.status = 0;
  return m;
}

}  // namespace legopt::bus
