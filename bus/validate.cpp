#include "bus/validate.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "bus/codec.h"
#include "bus/field_check.h"
#include "bus/spec_limits.h"
#include "bus/wire.h"

namespace legopt::bus {
namespace {

using std::size_t;

constexpr std::int64_t kSecond = 1'000'000;
constexpr std::int64_t kLongestLease_us = 86'400 * kSecond;
constexpr std::int64_t kLongestWall_us = 365 * 86'400 * kSecond;
constexpr std::int64_t kLongestRetry_us = 3'600 * kSecond;
constexpr std::int64_t kMostSlots = 1024;
constexpr std::int64_t kMostJobs = 1024;
constexpr std::int64_t kMostLeases = 4096;
constexpr std::int64_t kMostDatasets = 64;
constexpr std::int64_t kMostWaypoints = 1'000'000;
constexpr std::int64_t kMostWaypointNumbers = 4096;
constexpr std::int64_t kMostRows = 1'000'000;
constexpr std::int64_t kMostSignals = 64;
constexpr std::int64_t kMostPriority = 1000;
constexpr size_t kNameBytes = 256;
constexpr size_t kReasonBytes = 1000;
constexpr size_t kIdBytes = 128;
constexpr size_t kWordBytes = 64;
constexpr size_t kTextBytes = 4096;
constexpr size_t kLogBytes = size_t{64} << 10;
constexpr size_t kOptionsBytes = size_t{1} << 20;
constexpr size_t kJsonBytes = size_t{16} << 20;
constexpr size_t kAnswerBytes = size_t{48} << 20;
static_assert(kJsonBytes == spec_limits::kMostBytes);

// control_request.action, as far as it decides what else the message holds.
constexpr int kControlHold = 2, kControlPriority = 4, kControlRename = 7, kControlTag = 8, kControlUntag = 9;
constexpr int kLastControl = 10;

// A reason, name or tag; 0: none.
constexpr size_t MostReasonBytes(int action) {
  constexpr size_t kExperimentNameBytes = 200;
  constexpr size_t kTagBytes = 100;
  if (action == kControlHold) return kReasonBytes;
  if (action == kControlRename) return kExperimentNameBytes;
  return action == kControlTag || action == kControlUntag ? kTagBytes : 0;
}

template <class Array>
std::int32_t CountOf(const Array& array) {
  return static_cast<std::int32_t>(array.size());
}

void Clean(std::string& text, size_t limit = kTextBytes) { text = CleanText(std::move(text), limit); }

void InfiniteToNan(double& figure) {
  if (std::isinf(figure)) figure = std::nan("");
}

// Length of the UTF-8 character at the front of `text`, 0 when there is none (RFC 3629: no surrogates, nothing
// overlong).
size_t CharacterBytes(std::string_view text) {
  const auto at = [&](size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const auto tail = [&](size_t i) { return i < text.size() && (at(i) & 0xC0U) == 0x80U; };
  const std::uint8_t first = at(0);
  if (first < 0x80U) return first == 0 ? 0 : 1;
  if (first >= 0xC2U && first <= 0xDFU) return tail(1) ? 2 : 0;
  if (first >= 0xE0U && first <= 0xEFU) {
    if (!tail(1) || !tail(2)) return 0;
    if ((first == 0xE0U && at(1) < 0xA0U) || (first == 0xEDU && at(1) > 0x9FU)) return 0;
    return 3;
  }
  if (first >= 0xF0U && first <= 0xF4U) {
    if (!tail(1) || !tail(2) || !tail(3)) return 0;
    if ((first == 0xF0U && at(1) < 0x90U) || (first == 0xF4U && at(1) > 0x8FU)) return 0;
    return 4;
  }
  return 0;
}

}  // namespace

bool IsText(const std::string& text) {
  for (std::string_view rest = text; !rest.empty();) {
    const size_t length = CharacterBytes(rest);
    if (length == 0) return false;
    rest.remove_prefix(length);
  }
  return true;
}

std::string CleanText(std::string text, size_t limit) {
  if (text.size() <= limit && IsText(text)) return text;
  std::string clean;
  for (std::string_view rest = text; !rest.empty();) {
    const size_t length = CharacterBytes(rest);
    if (clean.size() + std::max<size_t>(length, 1) > limit) break;
    if (length == 0) {
      clean += '?';
      rest.remove_prefix(1);
    } else {
      clean += rest.substr(0, length);
      rest.remove_prefix(length);
    }
  }
  return clean;
}

template <>
void PrepareForWire(legopt_msg::frame& message) {
  message.payload_bytes = CountOf(message.payload);
}
template <>
void PrepareForWire(legopt_msg::chunk& message) {
  message.data_bytes = CountOf(message.data);
}
template <>
void PrepareForWire(legopt_msg::probe_reply& message) {
  Clean(message.database);
  Clean(message.hostname, kNameBytes);
}
template <>
void PrepareForWire(legopt_msg::hello_request& message) {
  message.num_datasets = CountOf(message.datasets);
  Clean(message.hostname, kNameBytes);
  Clean(message.build, kNameBytes);
}
template <>
void PrepareForWire(legopt_msg::hello_reply& message) {
  Clean(message.message);
}
template <>
void PrepareForWire(legopt_msg::lease_request& message) {
  message.num_datasets = CountOf(message.dataset_hashes);
}
template <>
void PrepareForWire(legopt_msg::lease_reply& message) {
  message.num_jobs = CountOf(message.jobs);
  Clean(message.message);
}
template <>
void PrepareForWire(legopt_msg::heartbeat_request& message) {
  message.num_leases = CountOf(message.leases);
}
template <>
void PrepareForWire(legopt_msg::heartbeat_reply& message) {
  message.num_leases = CountOf(message.verdicts);
}
template <>
void PrepareForWire(legopt_msg::result_request& message) {
  Clean(message.message);
  if (message.log_tail.size() > kLogBytes)
    message.log_tail.erase(0, message.log_tail.size() - kLogBytes);  // keep the end
  Clean(message.log_tail, kLogBytes);
  Clean(message.verdict_detail);
  for (double* figure :
       {&message.solver_cost, &message.solver_violation, &message.cost, &message.foot_violation,
        &message.com_violation_m, &message.limit_violation, &message.environment_depth_m, &message.self_depth_literal_m,
        &message.self_depth_strict_m, &message.interpolation_environment_depth_m, &message.interpolation_self_depth_m,
        &message.interpolation_free_share}) {
    InfiniteToNan(*figure);
  }
  for (const double value : message.waypoints) {
    if (std::isfinite(value)) continue;
    message.waypoints.clear();
    message.num_waypoints = 0;
    Clean(message.verdict_detail, kTextBytes - kWordBytes);
    message.verdict_detail += " [waypoints left out: not finite]";
    break;
  }
  message.num_values = CountOf(message.waypoints);
}
template <>
void PrepareForWire(legopt_msg::result_reply& message) {
  Clean(message.message);
}
template <>
void PrepareForWire(legopt_msg::submit_reply& message) {
  Clean(message.message);
}
template <>
void PrepareForWire(legopt_msg::query_reply& message) {
  Clean(message.message);
}
template <>
void PrepareForWire(legopt_msg::cancel_reply& message) {
  Clean(message.message);
}
template <>
void PrepareForWire(legopt_msg::control_request& message) {
  Clean(message.reason, kReasonBytes);
}
template <>
void PrepareForWire(legopt_msg::control_reply& message) {
  Clean(message.message);
}

std::string Validate(const legopt_msg::frame& m) {
  return FieldCheck()
      .Range("version", m.version, 1, INT16_MAX)
      .Range("kind", m.kind, 1, kLastFrameKind)
      .AtLeast("type", m.type, 1)
      .Range("code", m.code, 0, INT16_MAX)
      .AtLeast("sender", m.sender, 1)
      .AtLeast("destination", m.destination, 1)
      .AtLeast("session", m.session, 1)
      .AtLeast("call_id", m.call_id, 1)
      .Range("completed_below", m.completed_below, 0, m.call_id)
      .Count("payload_bytes", m.payload_bytes, m.payload.size(), static_cast<std::int64_t>(kMaxPayloadBytes))
      .fault();
}

std::string Validate(const legopt_msg::chunk& m) {
  FieldCheck check;
  check.Range("total_bytes", m.total_bytes, 1, static_cast<std::int64_t>(kMaxMessageBytes))
      .Range("ack_requested", m.ack_requested, 0, 1);
  if (!check.ok()) return check.fault();
  const auto chunk_bytes = static_cast<std::int64_t>(kChunkBytes);
  const std::int64_t last = (m.total_bytes - 1) / chunk_bytes;
  check.Range("index", m.index, 0, last)
      .Count("data_bytes", m.data_bytes, m.data.size(), chunk_bytes)
      .Require(m.data_bytes == (m.index == last ? m.total_bytes - last * chunk_bytes : chunk_bytes),
               "data_bytes: every chunk but the last is full");
  return check.fault();
}

std::string Validate(const legopt_msg::chunk_ack& m) {
  return FieldCheck()
      .Range("of_reply", m.of_reply, 0, 1)
      .Range("complete", m.complete, 0, 1)
      .AtLeast("received_below", m.received_below, 0)
      .Range("credit", m.credit, 1, static_cast<std::int64_t>(kWindow))
      .fault();
}

std::string Validate(const legopt_msg::probe_request& /*m*/) { return {}; }

std::string Validate(const legopt_msg::probe_reply& m) {
  return FieldCheck()
      .AtLeast("protocol_version", m.protocol_version, 1)
      .Text("server_version", m.server_version, 0, kNameBytes)
      .Text("hostname", m.hostname, 0, kNameBytes)
      .AtLeast("pid", m.pid, 1)
      .AtLeast("server_instance", m.server_instance, 1)
      .Text("database", m.database, 0, kTextBytes)
      .AtLeast("uptime_us", m.uptime_us, 0)
      .AtLeast("wall_clock_us", m.wall_clock_us, 0)
      .fault();
}

std::string Validate(const legopt_msg::dataset_ref& m) {
  return FieldCheck().Text("name", m.name, 0, kNameBytes).Hash("hash", m.hash).fault();
}

std::string Validate(const legopt_msg::hello_request& m) {
  FieldCheck check;
  check.AtLeast("protocol_version", m.protocol_version, 1)
      .Text("worker_name", m.worker_name, 1, kNameBytes)
      .Text("hostname", m.hostname, 0, kNameBytes)
      .AtLeast("pid", m.pid, 1)
      .Range("slots", m.slots, 1, kMostSlots)
      .Text("build", m.build, 0, kNameBytes)
      .Count("num_datasets", m.num_datasets, m.datasets.size(), kMostDatasets);
  for (size_t i = 0; check.ok() && i < m.datasets.size(); ++i) check.Nested("datasets", i, Validate(m.datasets[i]));
  return check.fault();
}

std::string Validate(const legopt_msg::hello_reply& m) {
  return FieldCheck()
      .Range("status", m.status, 0, 2)
      .AtLeast("server_instance", m.server_instance, 1)
      .AtLeast("worker_id", m.worker_id, m.status == 0 ? 1 : 0)
      .Range("lease_us", m.lease_us, 0, kLongestLease_us)
      .Range("heartbeat_us", m.heartbeat_us, 0, m.lease_us)
      .Text("message", m.message, 0, kTextBytes)
      .fault();
}

std::string Validate(const legopt_msg::lease_request& m) {
  FieldCheck check;
  check.AtLeast("worker_id", m.worker_id, 1)
      .AtLeast("server_instance", m.server_instance, 1)
      .Range("slot", m.slot, 0, kMostSlots - 1)
      .Range("max_jobs", m.max_jobs, 1, kMostJobs)
      .Count("num_datasets", m.num_datasets, m.dataset_hashes.size(), kMostDatasets);
  for (const std::string& hash : m.dataset_hashes) check.Hash("dataset_hashes", hash);
  return check.fault();
}

std::string Validate(const legopt_msg::lease& m) {
  return FieldCheck()
      .AtLeast("job_id", m.job_id, 1)
      .AtLeast("experiment_id", m.experiment_id, 1)
      .AtLeast("attempt", m.attempt, 1)
      .NonZero("token", m.token)
      .Range("lease_us", m.lease_us, 1, kLongestLease_us)
      .Hash("dataset_hash", m.dataset_hash)
      .Hash("method_hash", m.method_hash)
      .OneOf("task", m.task, "posture", "motion")
      .OneOf("initialization", m.initialization, "good", "in_collision")
      .AtLeast("problem_id", m.problem_id, 0)
      .AtLeast("repetition", m.repetition, 0)
      .Range("wall_limit_us", m.wall_limit_us, 1, kLongestWall_us)
      .AtLeast("memory_limit_bytes", m.memory_limit_bytes, 0)
      .fault();
}

std::string Validate(const legopt_msg::lease_reply& m) {
  FieldCheck check;
  check.Range("status", m.status, 0, 4)
      .Range("retry_after_us", m.retry_after_us, 0, kLongestRetry_us)
      .Text("message", m.message, 0, kTextBytes)
      .Count("num_jobs", m.num_jobs, m.jobs.size(), kMostJobs)
      .Require((m.status == 0) == (m.num_jobs > 0), "num_jobs: jobs come with status 0 and with no other");
  for (size_t i = 0; check.ok() && i < m.jobs.size(); ++i) check.Nested("jobs", i, Validate(m.jobs[i]));
  return check.fault();
}

std::string Validate(const legopt_msg::method_request& m) { return FieldCheck().Hash("hash", m.hash).fault(); }

std::string Validate(const legopt_msg::method_reply& m) {
  return FieldCheck()
      .Range("status", m.status, 0, 1)
      .Json("options_json", m.options_json, m.status == 0 ? 2 : 0, kOptionsBytes)
      .fault();
}

std::string Validate(const legopt_msg::lease_state& m) {
  return FieldCheck()
      .AtLeast("job_id", m.job_id, 1)
      .AtLeast("attempt", m.attempt, 1)
      .NonZero("token", m.token)
      .AtLeast("progress_total", m.progress_total, 0)
      .Range("progress_done", m.progress_done, 0, m.progress_total)
      .fault();
}

std::string Validate(const legopt_msg::heartbeat_request& m) {
  FieldCheck check;
  check.AtLeast("worker_id", m.worker_id, 1)
      .AtLeast("server_instance", m.server_instance, 1)
      .Count("num_leases", m.num_leases, m.leases.size(), kMostLeases);
  for (size_t i = 0; check.ok() && i < m.leases.size(); ++i) check.Nested("leases", i, Validate(m.leases[i]));
  return check.fault();
}

std::string Validate(const legopt_msg::heartbeat_reply& m) {
  FieldCheck check;
  check.AtLeast("server_instance", m.server_instance, 1)
      .Range("status", m.status, 0, 2)
      .Count("num_leases", m.num_leases, m.verdicts.size(), kMostLeases);
  for (const std::int8_t verdict : m.verdicts) check.Range("verdicts", verdict, 0, 2);
  return check.fault();
}

std::string Validate(const legopt_msg::result_request& m) {
  FieldCheck check;
  check.AtLeast("worker_id", m.worker_id, 1)
      .AtLeast("job_id", m.job_id, 1)
      .AtLeast("attempt", m.attempt, 1)
      .NonZero("token", m.token)
      .Range("outcome", m.outcome, 0, 5)
      .Text("message", m.message, 0, kTextBytes)
      .Text("log_tail", m.log_tail, 0, kLogBytes)
      .Range("exit_signal", m.exit_signal, 0, kMostSignals)
      .Text("solver_status", m.solver_status, 0, kWordBytes)
      .AtLeast("iterations", m.iterations, 0)
      .AtLeast("restarts", m.restarts, 0)
      .AtLeast("wall_us", m.wall_us, 0)
      .AtLeast("cpu_us", m.cpu_us, 0)
      .AtLeast("involuntary_context_switches", m.involuntary_context_switches, 0)
      .AtLeast("peak_memory_bytes", m.peak_memory_bytes, 0)
      .NanOrFinite("solver_cost", m.solver_cost)
      .NanOrFinite("solver_violation", m.solver_violation)
      .Text("verdict_literal", m.verdict_literal, 0, kWordBytes)
      .Text("verdict_strict", m.verdict_strict, 0, kWordBytes)
      .Text("verdict_detail", m.verdict_detail, 0, kTextBytes)
      .AtLeast("failed_waypoint", m.failed_waypoint, -1)
      .NanOrFinite("cost", m.cost)
      .NanOrFinite("foot_violation", m.foot_violation)
      .NanOrFinite("com_violation_m", m.com_violation_m)
      .NanOrFinite("limit_violation", m.limit_violation)
      .NanOrFinite("environment_depth_m", m.environment_depth_m)
      .NanOrFinite("self_depth_literal_m", m.self_depth_literal_m)
      .NanOrFinite("self_depth_strict_m", m.self_depth_strict_m)
      .NanOrFinite("interpolation_environment_depth_m", m.interpolation_environment_depth_m)
      .NanOrFinite("interpolation_self_depth_m", m.interpolation_self_depth_m)
      .NanOrFinite("interpolation_free_share", m.interpolation_free_share)
      .Require(!(m.interpolation_environment_depth_m < 0 || m.interpolation_self_depth_m < 0),
               "interpolation: a depth is negative")
      .Require(!(m.interpolation_free_share < 0 || m.interpolation_free_share > 1),
               "interpolation_free_share: must be within 0 .. 1")
      .AtLeast("windows", m.windows, 0)
      .Range("windows_solved", m.windows_solved, 0, m.windows)
      .Range("num_waypoints", m.num_waypoints, 0, kMostWaypoints)
      .Range("waypoint_size", m.waypoint_size, 0, kMostWaypointNumbers)
      .Count("num_values", m.num_values, m.waypoints.size(), INT32_MAX)
      .Require(std::int64_t{m.num_waypoints} * m.waypoint_size == m.num_values,
               "num_values: must be num_waypoints * waypoint_size")
      .Json("history_json", m.history_json, 0, kJsonBytes);
  for (const double value : m.waypoints) {
    if (!std::isfinite(value)) return check.Finite("waypoints", value).fault();
  }
  return check.fault();
}

std::string Validate(const legopt_msg::result_reply& m) {
  return FieldCheck().Range("status", m.status, 0, 3).Text("message", m.message, 0, kTextBytes).fault();
}

std::string Validate(const legopt_msg::submit_request& m) {
  return FieldCheck()
      .Text("submission_id", m.submission_id, 1, kIdBytes)
      .Json("spec_json", m.spec_json, 1, kJsonBytes)
      .fault();
}

std::string Validate(const legopt_msg::submit_reply& m) {
  return FieldCheck()
      .Range("status", m.status, 0, 2)
      .AtLeast("experiment_id", m.experiment_id, m.status == 2 ? 0 : 1)
      .AtLeast("num_jobs", m.num_jobs, 0)
      .Text("message", m.message, 0, kTextBytes)
      .fault();
}

std::string Validate(const legopt_msg::status_request& m) {
  return FieldCheck().AtLeast("experiment_id", m.experiment_id, 0).fault();
}

std::string Validate(const legopt_msg::status_reply& m) {
  return FieldCheck().Json("json", m.json, 2, kJsonBytes).fault();
}

std::string Validate(const legopt_msg::query_request& m) {
  return FieldCheck().Text("sql", m.sql, 1, kOptionsBytes).Range("max_rows", m.max_rows, 1, kMostRows).fault();
}

std::string Validate(const legopt_msg::query_reply& m) {
  return FieldCheck()
      .Range("status", m.status, 0, 2)
      .Text("message", m.message, 0, kTextBytes)
      .Json("json", m.json, m.status == 0 ? 2 : 0, kAnswerBytes)
      .fault();
}

std::string Validate(const legopt_msg::cancel_request& m) {
  return FieldCheck().AtLeast("experiment_id", m.experiment_id, 1).fault();
}

std::string Validate(const legopt_msg::cancel_reply& m) {
  return FieldCheck()
      .Range("status", m.status, 0, 2)
      .AtLeast("num_jobs", m.num_jobs, 0)
      .Text("message", m.message, 0, kTextBytes)
      .fault();
}

std::string Validate(const legopt_msg::control_request& m) {
  const std::int64_t most = m.action == kControlPriority ? kMostPriority : 0;
  const size_t most_bytes = MostReasonBytes(m.action);
  return FieldCheck()
      .AtLeast("experiment_id", m.experiment_id, 1)
      .Range("action", m.action, 0, kLastControl)
      .Range("priority", m.priority, -most, most)
      .Text("reason", m.reason, most_bytes > 0 ? 1 : 0, most_bytes)
      .fault();
}

std::string Validate(const legopt_msg::control_reply& m) {
  return FieldCheck()
      .Range("status", m.status, 0, 2)
      .AtLeast("num_jobs", m.num_jobs, 0)
      .Text("message", m.message, 0, kTextBytes)
      .fault();
}

std::string Validate(const legopt_msg::shutdown_request& /*m*/) { return {}; }

std::string Validate(const legopt_msg::shutdown_reply& m) {
  return FieldCheck().Range("status", m.status, 0, 1).fault();
}

}  // namespace legopt::bus
