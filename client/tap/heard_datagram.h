#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>

#include "bus/wire.h"

namespace legopt::client {

/// One datagram of a deployment as somebody reads it who takes no part.
struct HeardDatagram {
  bus::Port port{};
  std::size_t bytes = 0;
  bus::FrameFault fault{};  ///< of the datagram; its payload is looked at as well only when there is none
  bool is_frame = false;    ///< `header` stands; unchecked when `rejected` is "deployment", "tag" or "field"
  bus::FrameHeader header;
  std::string_view tag;            ///< "signed" (under the key), "unsigned" (a checksum), "wrong"; empty: not looked at
  std::string_view rejected;       ///< why no party takes it, as in bus/counters.h ("size", "tag", ...); empty: legal
  std::string why;                 ///< with "body" and "type": the fault in words
  nlohmann::ordered_json payload;  ///< {"body": {...}}, {"chunk": {...}}, ... of a legal frame; else null
};

/// Reads one datagram of `deployment` with every check of a party, but for what only a party can know (replays, open
/// calls, whole large bodies). Without `key` a wrong tag means damage, or a key that we do not have. Never throws on
/// what was heard. Source: PROTOCOL.md, sections 3, 6, 7 and 11.
HeardDatagram ReadDatagram(bus::Port port, std::span<const std::uint8_t> datagram, std::int64_t deployment,
                           const bus::MessageKey* key);

/// "request", "reply", "error", "request_chunk", "reply_chunk", "chunk_ack", "proof"; "none" for what is no frame, and
/// "unknown".
std::string_view KindName(const HeardDatagram& heard);
/// "lease", ...; "none" for what is no frame, "unknown" for a number that no call has.
std::string_view TypeName(const HeardDatagram& heard);

/// One object: when and where it was heard, header, tag, and the payload or what is wrong with it.
nlohmann::ordered_json DatagramToJson(const HeardDatagram& heard, std::int64_t wall_clock_us);

}  // namespace legopt::client
