#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "bus/messages.h"
#include "bus/wire.h"

namespace legopt::client {

/// Converts the body of a request or reply to JSON: fields by name, in the order of the .lcm file; 64-bit numbers
/// exact, NaN as null, nested messages as objects. Returns nullopt if `body` is not exactly one legal message of that
/// call; `why` then contains the error. Source: bus/message_fields.h, PROTOCOL.md, section 7. Thread rule: none, no
/// state.
std::optional<nlohmann::ordered_json> BodyToJson(bus::MessageType type, bool of_reply, std::string_view body,
                                                 std::string* why);

/// A datagram of a deployment, decoded by an observer.
struct CapturedDatagram {
  bus::Port port{};
  std::size_t bytes = 0;
  bus::FrameFault fault{};  ///< error of the datagram; the payload is checked only if there is none
  bool is_frame = false;    ///< `header` is valid; unverified if `rejected` is "deployment", "tag" or "field"
  bus::FrameHeader header;
  std::string_view tag;            ///< "signed" (with the key), "unsigned" (a checksum), "wrong"; empty: not checked
  std::string_view rejected;       ///< why receivers reject it, as in bus/endpoint.h ("size", "tag", ...); empty: legal
  std::string why;                 ///< description of the error for "body" and "type"
  nlohmann::ordered_json payload;  ///< {"body": {...}}, {"chunk": {...}}, ... of a legal frame; else null
};

/// Decodes a datagram of `deployment` with the checks of a receiver, except those that need its state (replays, open
/// calls, complete large bodies). Without `key`, a wrong tag means damage or another key. Never throws on received
/// data. Source: PROTOCOL.md, sections 3, 6, 7 and 11.
CapturedDatagram ReadDatagram(bus::Port port, std::span<const std::uint8_t> datagram, std::int64_t deployment,
                              const bus::MessageKey* key);

/// Returns "request", "reply", "error", "request_chunk", "reply_chunk", "chunk_ack", "proof"; "none" if it is not a
/// frame, or "unknown".
std::string_view KindName(const CapturedDatagram& heard);
/// Returns "lease", ...; "none" if it is not a frame, "unknown" for an unknown message type.
std::string_view TypeName(const CapturedDatagram& heard);

/// Returns an object with time, port, header, tag, and the payload or its error.
nlohmann::ordered_json DatagramToJson(const CapturedDatagram& heard, std::int64_t wall_clock_us);

}  // namespace legopt::client
