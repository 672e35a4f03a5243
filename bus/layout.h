// Byte layout of each message, to bound what a generated decoder allocates before it runs.
//
// The generated decoders size vectors by the count they read, before they look whether so many bytes are there: a
// datagram of 100 bytes could cost gigabytes. LayoutFits() walks the encoded bytes first. Grammar of a layout, in order
// of the fields: '1' '2' '4' '8' a number of so many bytes; 's' an LCM string (int32 length with its final NUL, bytes,
// NUL); "a(...)" an int32 count and then so many groups. The fingerprint is not part of it. Source: the .lcm files; the
// tests compare each layout with the generated encoder.
#pragma once

#include <string_view>

#include "bus/messages.h"

namespace legopt::bus {

// Whether `bytes` (after the fingerprint) is exactly one message of this layout.
bool LayoutFits(std::string_view layout, std::string_view bytes);

template <class Message>
inline constexpr std::string_view kLayout = {};
template <>
inline constexpr std::string_view kLayout<legopt_msg::frame> = "2222888888888a(1)";
template <>
inline constexpr std::string_view kLayout<legopt_msg::chunk> = "8888841a(1)";
template <>
inline constexpr std::string_view kLayout<legopt_msg::chunk_ack> = "118484";
template <>
inline constexpr std::string_view kLayout<legopt_msg::probe_request> = "8";
template <>
inline constexpr std::string_view kLayout<legopt_msg::probe_reply> = "4ss88s88";
template <>
inline constexpr std::string_view kLayout<legopt_msg::dataset_ref> = "ss";
template <>
inline constexpr std::string_view kLayout<legopt_msg::hello_request> = "4ss84sa(ss)";
template <>
inline constexpr std::string_view kLayout<legopt_msg::hello_reply> = "48888s";
template <>
inline constexpr std::string_view kLayout<legopt_msg::lease_request> = "8844a(s)";
template <>
inline constexpr std::string_view kLayout<legopt_msg::lease> = "88488ssss44888";
template <>
inline constexpr std::string_view kLayout<legopt_msg::lease_reply> = "48sa(88488ssss44888)";
template <>
inline constexpr std::string_view kLayout<legopt_msg::method_request> = "s";
template <>
inline constexpr std::string_view kLayout<legopt_msg::method_reply> = "4s";
template <>
inline constexpr std::string_view kLayout<legopt_msg::lease_state> = "84888";
template <>
inline constexpr std::string_view kLayout<legopt_msg::heartbeat_request> = "88a(84888)";
template <>
inline constexpr std::string_view kLayout<legopt_msg::heartbeat_reply> = "84a(1)";
template <>
inline constexpr std::string_view kLayout<legopt_msg::result_request> = "88481ss4s44888888sss488888888884444a(8)s";
template <>
inline constexpr std::string_view kLayout<legopt_msg::result_reply> = "4s";
template <>
inline constexpr std::string_view kLayout<legopt_msg::submit_request> = "ss";
template <>
inline constexpr std::string_view kLayout<legopt_msg::submit_reply> = "488s";
template <>
inline constexpr std::string_view kLayout<legopt_msg::status_request> = "8";
template <>
inline constexpr std::string_view kLayout<legopt_msg::status_reply> = "s";
template <>
inline constexpr std::string_view kLayout<legopt_msg::query_request> = "s4";
template <>
inline constexpr std::string_view kLayout<legopt_msg::query_reply> = "4ss";
template <>
inline constexpr std::string_view kLayout<legopt_msg::cancel_request> = "8";
template <>
inline constexpr std::string_view kLayout<legopt_msg::cancel_reply> = "48s";
template <>
inline constexpr std::string_view kLayout<legopt_msg::control_request> = "814s";
template <>
inline constexpr std::string_view kLayout<legopt_msg::control_reply> = "48s";
template <>
inline constexpr std::string_view kLayout<legopt_msg::shutdown_request> = "8";
template <>
inline constexpr std::string_view kLayout<legopt_msg::shutdown_reply> = "4";

}  // namespace legopt::bus
