// Ranges and consistency of every message field, as PROTOCOL.md section 7 promises them.
//
// PrepareForWire(message): sets each num_* field from its array and cuts and cleans texts that are for humans (too
// long,
//   NUL or invalid UTF-8 must not keep a result from being delivered). In a result, infinite figures become NaN, and
//   waypoints that are not all finite are left out, with a note in verdict_detail.
// Validate(message): empty when legal, else "field: value: what is allowed".
#pragma once

#include <string>

#include "bus/messages.h"

namespace legopt::bus {

// Messages without arrays and free texts need no preparation.
template <class Message>
void PrepareForWire(Message& /*message*/) {}
template <>
void PrepareForWire(legopt_msg::frame& message);
template <>
void PrepareForWire(legopt_msg::chunk& message);
template <>
void PrepareForWire(legopt_msg::probe_reply& message);
template <>
void PrepareForWire(legopt_msg::hello_request& message);
template <>
void PrepareForWire(legopt_msg::hello_reply& message);
template <>
void PrepareForWire(legopt_msg::lease_request& message);
template <>
void PrepareForWire(legopt_msg::lease_reply& message);
template <>
void PrepareForWire(legopt_msg::heartbeat_request& message);
template <>
void PrepareForWire(legopt_msg::heartbeat_reply& message);
template <>
void PrepareForWire(legopt_msg::result_request& message);
template <>
void PrepareForWire(legopt_msg::result_reply& message);
template <>
void PrepareForWire(legopt_msg::submit_reply& message);
template <>
void PrepareForWire(legopt_msg::query_reply& message);
template <>
void PrepareForWire(legopt_msg::cancel_reply& message);
template <>
void PrepareForWire(legopt_msg::control_request& message);
template <>
void PrepareForWire(legopt_msg::control_reply& message);

std::string Validate(const legopt_msg::frame& message);
std::string Validate(const legopt_msg::chunk& message);
std::string Validate(const legopt_msg::chunk_ack& message);
std::string Validate(const legopt_msg::probe_request& message);
std::string Validate(const legopt_msg::probe_reply& message);
std::string Validate(const legopt_msg::dataset_ref& message);
std::string Validate(const legopt_msg::hello_request& message);
std::string Validate(const legopt_msg::hello_reply& message);
std::string Validate(const legopt_msg::lease_request& message);
std::string Validate(const legopt_msg::lease& message);
std::string Validate(const legopt_msg::lease_reply& message);
std::string Validate(const legopt_msg::method_request& message);
std::string Validate(const legopt_msg::method_reply& message);
std::string Validate(const legopt_msg::lease_state& message);
std::string Validate(const legopt_msg::heartbeat_request& message);
std::string Validate(const legopt_msg::heartbeat_reply& message);
std::string Validate(const legopt_msg::result_request& message);
std::string Validate(const legopt_msg::result_reply& message);
std::string Validate(const legopt_msg::submit_request& message);
std::string Validate(const legopt_msg::submit_reply& message);
std::string Validate(const legopt_msg::status_request& message);
std::string Validate(const legopt_msg::status_reply& message);
std::string Validate(const legopt_msg::query_request& message);
std::string Validate(const legopt_msg::query_reply& message);
std::string Validate(const legopt_msg::cancel_request& message);
std::string Validate(const legopt_msg::cancel_reply& message);
std::string Validate(const legopt_msg::control_request& message);
std::string Validate(const legopt_msg::control_reply& message);
std::string Validate(const legopt_msg::shutdown_request& message);
std::string Validate(const legopt_msg::shutdown_reply& message);

// `text` with at most `limit` bytes (whole characters), NULs and bytes that are not UTF-8 replaced by '?'.
std::string CleanText(std::string text, std::size_t limit);
bool IsText(const std::string& text);  // UTF-8 without NUL

}  // namespace legopt::bus
