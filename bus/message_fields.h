// Every call, and the fields of each message: for who shows messages (`legopt tap`), and for their layouts (layout.h).
//
// kFields<Message> is a std::tuple of Field{name, pointer to member}, in the order of the .lcm file. The generated
// types know nothing of their fields; this is the one place that tells. A message without an entry does not compile
// where it is shown, and the tests compare every entry with its .lcm file. Thread rule: none, constants.
#pragma once

#include <string_view>
#include <tuple>

#include "bus/messages.h"

namespace legopt::bus {

// The request of every call, by message type: kProbe first.
using Requests = std::tuple<legopt_msg::probe_request, legopt_msg::hello_request, legopt_msg::lease_request,
                            legopt_msg::heartbeat_request, legopt_msg::result_request, legopt_msg::method_request,
                            legopt_msg::submit_request, legopt_msg::status_request, legopt_msg::query_request,
                            legopt_msg::cancel_request, legopt_msg::shutdown_request, legopt_msg::control_request>;
static_assert(std::tuple_size_v<Requests> == kLastMessageType);

template <class Message, class Value>
struct Field {
  std::string_view name;
  Value Message::*member;
};
template <class Message, class Value>
Field(std::string_view, Value Message::*) -> Field<Message, Value>;

template <class Message>
struct NoFieldsAreListed;
template <class Message>
inline constexpr NoFieldsAreListed<Message> kFields{};
template <>
inline constexpr auto kFields<legopt_msg::frame> =
    std::tuple{Field{"version", &legopt_msg::frame::version},
               Field{"kind", &legopt_msg::frame::kind},
               Field{"type", &legopt_msg::frame::type},
               Field{"code", &legopt_msg::frame::code},
               Field{"deployment", &legopt_msg::frame::deployment},
               Field{"sender", &legopt_msg::frame::sender},
               Field{"destination", &legopt_msg::frame::destination},
               Field{"session", &legopt_msg::frame::session},
               Field{"call_id", &legopt_msg::frame::call_id},
               Field{"completed_below", &legopt_msg::frame::completed_below},
               Field{"nonce", &legopt_msg::frame::nonce},
               Field{"tag", &legopt_msg::frame::tag},
               Field{"payload_bytes", &legopt_msg::frame::payload_bytes},
               Field{"payload", &legopt_msg::frame::payload}};
template <>
inline constexpr auto kFields<legopt_msg::chunk> = std::tuple{Field{"total_bytes", &legopt_msg::chunk::total_bytes},
                                                              Field{"hash", &legopt_msg::chunk::hash},
                                                              Field{"index", &legopt_msg::chunk::index},
                                                              Field{"ack_requested", &legopt_msg::chunk::ack_requested},
                                                              Field{"data_bytes", &legopt_msg::chunk::data_bytes},
                                                              Field{"data", &legopt_msg::chunk::data}};
template <>
inline constexpr auto kFields<legopt_msg::chunk_ack> =
    std::tuple{Field{"of_reply", &legopt_msg::chunk_ack::of_reply},
               Field{"complete", &legopt_msg::chunk_ack::complete},
               Field{"reassembly", &legopt_msg::chunk_ack::reassembly},
               Field{"received_below", &legopt_msg::chunk_ack::received_below},
               Field{"received_mask", &legopt_msg::chunk_ack::received_mask},
               Field{"credit", &legopt_msg::chunk_ack::credit}};
template <>
inline constexpr auto kFields<legopt_msg::probe_request> =
    std::tuple{Field{"nonce", &legopt_msg::probe_request::nonce}};
template <>
inline constexpr auto kFields<legopt_msg::probe_reply> =
    std::tuple{Field{"protocol_version", &legopt_msg::probe_reply::protocol_version},
               Field{"server_version", &legopt_msg::probe_reply::server_version},
               Field{"hostname", &legopt_msg::probe_reply::hostname},
               Field{"pid", &legopt_msg::probe_reply::pid},
               Field{"server_instance", &legopt_msg::probe_reply::server_instance},
               Field{"database", &legopt_msg::probe_reply::database},
               Field{"uptime_us", &legopt_msg::probe_reply::uptime_us},
               Field{"wall_clock_us", &legopt_msg::probe_reply::wall_clock_us}};
template <>
inline constexpr auto kFields<legopt_msg::dataset_ref> =
    std::tuple{Field{"name", &legopt_msg::dataset_ref::name}, Field{"hash", &legopt_msg::dataset_ref::hash}};
template <>
inline constexpr auto kFields<legopt_msg::hello_request> =
    std::tuple{Field{"protocol_version", &legopt_msg::hello_request::protocol_version},
               Field{"worker_name", &legopt_msg::hello_request::worker_name},
               Field{"hostname", &legopt_msg::hello_request::hostname},
               Field{"pid", &legopt_msg::hello_request::pid},
               Field{"slots", &legopt_msg::hello_request::slots},
               Field{"build", &legopt_msg::hello_request::build},
               Field{"num_datasets", &legopt_msg::hello_request::num_datasets},
               Field{"datasets", &legopt_msg::hello_request::datasets}};
template <>
inline constexpr auto kFields<legopt_msg::hello_reply> =
    std::tuple{Field{"status", &legopt_msg::hello_reply::status},
               Field{"server_instance", &legopt_msg::hello_reply::server_instance},
               Field{"worker_id", &legopt_msg::hello_reply::worker_id},
               Field{"lease_us", &legopt_msg::hello_reply::lease_us},
               Field{"heartbeat_us", &legopt_msg::hello_reply::heartbeat_us},
               Field{"message", &legopt_msg::hello_reply::message}};
template <>
inline constexpr auto kFields<legopt_msg::lease_request> =
    std::tuple{Field{"worker_id", &legopt_msg::lease_request::worker_id},
               Field{"server_instance", &legopt_msg::lease_request::server_instance},
               Field{"slot", &legopt_msg::lease_request::slot},
               Field{"max_jobs", &legopt_msg::lease_request::max_jobs},
               Field{"num_datasets", &legopt_msg::lease_request::num_datasets},
               Field{"dataset_hashes", &legopt_msg::lease_request::dataset_hashes}};
template <>
inline constexpr auto kFields<legopt_msg::lease> =
    std::tuple{Field{"job_id", &legopt_msg::lease::job_id},
               Field{"experiment_id", &legopt_msg::lease::experiment_id},
               Field{"attempt", &legopt_msg::lease::attempt},
               Field{"token", &legopt_msg::lease::token},
               Field{"lease_us", &legopt_msg::lease::lease_us},
               Field{"dataset_hash", &legopt_msg::lease::dataset_hash},
               Field{"method_hash", &legopt_msg::lease::method_hash},
               Field{"task", &legopt_msg::lease::task},
               Field{"initialization", &legopt_msg::lease::initialization},
               Field{"problem_id", &legopt_msg::lease::problem_id},
               Field{"repetition", &legopt_msg::lease::repetition},
               Field{"experiment_seed", &legopt_msg::lease::experiment_seed},
               Field{"wall_limit_us", &legopt_msg::lease::wall_limit_us},
               Field{"memory_limit_bytes", &legopt_msg::lease::memory_limit_bytes}};
template <>
inline constexpr auto kFields<legopt_msg::lease_reply> =
    std::tuple{Field{"status", &legopt_msg::lease_reply::status},
               Field{"retry_after_us", &legopt_msg::lease_reply::retry_after_us},
               Field{"message", &legopt_msg::lease_reply::message},
               Field{"num_jobs", &legopt_msg::lease_reply::num_jobs}, Field{"jobs", &legopt_msg::lease_reply::jobs}};
template <>
inline constexpr auto kFields<legopt_msg::method_request> =
    std::tuple{Field{"hash", &legopt_msg::method_request::hash}};
template <>
inline constexpr auto kFields<legopt_msg::method_reply> = std::tuple{
    Field{"status", &legopt_msg::method_reply::status}, Field{"options_json", &legopt_msg::method_reply::options_json}};
template <>
inline constexpr auto kFields<legopt_msg::lease_state> = std::tuple{
    Field{"job_id", &legopt_msg::lease_state::job_id}, Field{"attempt", &legopt_msg::lease_state::attempt},
    Field{"token", &legopt_msg::lease_state::token}, Field{"progress_done", &legopt_msg::lease_state::progress_done},
    Field{"progress_total", &legopt_msg::lease_state::progress_total}};
template <>
inline constexpr auto kFields<legopt_msg::heartbeat_request> =
    std::tuple{Field{"worker_id", &legopt_msg::heartbeat_request::worker_id},
               Field{"server_instance", &legopt_msg::heartbeat_request::server_instance},
               Field{"num_leases", &legopt_msg::heartbeat_request::num_leases},
               Field{"leases", &legopt_msg::heartbeat_request::leases}};
template <>
inline constexpr auto kFields<legopt_msg::heartbeat_reply> =
    std::tuple{Field{"server_instance", &legopt_msg::heartbeat_reply::server_instance},
               Field{"status", &legopt_msg::heartbeat_reply::status},
               Field{"num_leases", &legopt_msg::heartbeat_reply::num_leases},
               Field{"verdicts", &legopt_msg::heartbeat_reply::verdicts}};
template <>
inline constexpr auto kFields<legopt_msg::result_request> = std::tuple{
    Field{"worker_id", &legopt_msg::result_request::worker_id},
    Field{"job_id", &legopt_msg::result_request::job_id},
    Field{"attempt", &legopt_msg::result_request::attempt},
    Field{"token", &legopt_msg::result_request::token},
    Field{"outcome", &legopt_msg::result_request::outcome},
    Field{"message", &legopt_msg::result_request::message},
    Field{"log_tail", &legopt_msg::result_request::log_tail},
    Field{"exit_signal", &legopt_msg::result_request::exit_signal},
    Field{"solver_status", &legopt_msg::result_request::solver_status},
    Field{"iterations", &legopt_msg::result_request::iterations},
    Field{"restarts", &legopt_msg::result_request::restarts},
    Field{"wall_us", &legopt_msg::result_request::wall_us},
    Field{"cpu_us", &legopt_msg::result_request::cpu_us},
    Field{"involuntary_context_switches", &legopt_msg::result_request::involuntary_context_switches},
    Field{"peak_memory_bytes", &legopt_msg::result_request::peak_memory_bytes},
    Field{"solver_cost", &legopt_msg::result_request::solver_cost},
    Field{"solver_violation", &legopt_msg::result_request::solver_violation},
    Field{"verdict_literal", &legopt_msg::result_request::verdict_literal},
    Field{"verdict_strict", &legopt_msg::result_request::verdict_strict},
    Field{"verdict_detail", &legopt_msg::result_request::verdict_detail},
    Field{"failed_waypoint", &legopt_msg::result_request::failed_waypoint},
    Field{"cost", &legopt_msg::result_request::cost},
    Field{"foot_violation", &legopt_msg::result_request::foot_violation},
    Field{"com_violation_m", &legopt_msg::result_request::com_violation_m},
    Field{"limit_violation", &legopt_msg::result_request::limit_violation},
    Field{"environment_depth_m", &legopt_msg::result_request::environment_depth_m},
    Field{"self_depth_literal_m", &legopt_msg::result_request::self_depth_literal_m},
    Field{"self_depth_strict_m", &legopt_msg::result_request::self_depth_strict_m},
    Field{"interpolation_environment_depth_m", &legopt_msg::result_request::interpolation_environment_depth_m},
    Field{"interpolation_self_depth_m", &legopt_msg::result_request::interpolation_self_depth_m},
    Field{"interpolation_free_share", &legopt_msg::result_request::interpolation_free_share},
    Field{"windows", &legopt_msg::result_request::windows},
    Field{"windows_solved", &legopt_msg::result_request::windows_solved},
    Field{"num_waypoints", &legopt_msg::result_request::num_waypoints},
    Field{"waypoint_size", &legopt_msg::result_request::waypoint_size},
    Field{"num_values", &legopt_msg::result_request::num_values},
    Field{"waypoints", &legopt_msg::result_request::waypoints},
    Field{"history_json", &legopt_msg::result_request::history_json}};
template <>
inline constexpr auto kFields<legopt_msg::result_reply> = std::tuple{
    Field{"status", &legopt_msg::result_reply::status}, Field{"message", &legopt_msg::result_reply::message}};
template <>
inline constexpr auto kFields<legopt_msg::submit_request> =
    std::tuple{Field{"submission_id", &legopt_msg::submit_request::submission_id},
               Field{"spec_json", &legopt_msg::submit_request::spec_json}};
template <>
inline constexpr auto kFields<legopt_msg::submit_reply> = std::tuple{
    Field{"status", &legopt_msg::submit_reply::status},
    Field{"experiment_id", &legopt_msg::submit_reply::experiment_id},
    Field{"num_jobs", &legopt_msg::submit_reply::num_jobs}, Field{"message", &legopt_msg::submit_reply::message}};
template <>
inline constexpr auto kFields<legopt_msg::status_request> =
    std::tuple{Field{"experiment_id", &legopt_msg::status_request::experiment_id}};
template <>
inline constexpr auto kFields<legopt_msg::status_reply> = std::tuple{Field{"json", &legopt_msg::status_reply::json}};
template <>
inline constexpr auto kFields<legopt_msg::query_request> =
    std::tuple{Field{"sql", &legopt_msg::query_request::sql}, Field{"max_rows", &legopt_msg::query_request::max_rows}};
template <>
inline constexpr auto kFields<legopt_msg::query_reply> =
    std::tuple{Field{"status", &legopt_msg::query_reply::status}, Field{"message", &legopt_msg::query_reply::message},
               Field{"json", &legopt_msg::query_reply::json}};
template <>
inline constexpr auto kFields<legopt_msg::cancel_request> =
    std::tuple{Field{"experiment_id", &legopt_msg::cancel_request::experiment_id}};
template <>
inline constexpr auto kFields<legopt_msg::cancel_reply> = std::tuple{
    Field{"status", &legopt_msg::cancel_reply::status}, Field{"num_jobs", &legopt_msg::cancel_reply::num_jobs},
    Field{"message", &legopt_msg::cancel_reply::message}};
template <>
inline constexpr auto kFields<legopt_msg::control_request> = std::tuple{
    Field{"experiment_id", &legopt_msg::control_request::experiment_id},
    Field{"action", &legopt_msg::control_request::action}, Field{"priority", &legopt_msg::control_request::priority},
    Field{"reason", &legopt_msg::control_request::reason}};
template <>
inline constexpr auto kFields<legopt_msg::control_reply> = std::tuple{
    Field{"status", &legopt_msg::control_reply::status}, Field{"num_jobs", &legopt_msg::control_reply::num_jobs},
    Field{"message", &legopt_msg::control_reply::message}};
template <>
inline constexpr auto kFields<legopt_msg::shutdown_request> =
    std::tuple{Field{"nonce", &legopt_msg::shutdown_request::nonce}};
template <>
inline constexpr auto kFields<legopt_msg::shutdown_reply> =
    std::tuple{Field{"status", &legopt_msg::shutdown_reply::status}};

}  // namespace legopt::bus
