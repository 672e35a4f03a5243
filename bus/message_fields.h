#pragma once

#include "bus/client_call_fields.h"
#include "bus/codec.h"
#include "bus/field.h"
#include "bus/messages.h"
#include "bus/wire.h"
#include "bus/worker_call_fields.h"

namespace legopt::bus::fields {

/// @file
/// Fields of frames and of the chunks of large bodies: PROTOCOL.md, sections 3 and 6.

template <>
struct Description<legopt_msg::frame> {
  using M = legopt_msg::frame;
  static constexpr std::tuple kRows{Field{"version", &M::version, Range{1, INT16_MAX}},
                                    Field{"kind", &M::kind, Range{1, kLastFrameKind}},
                                    Field{"type", &M::type, AtLeast{1}},
                                    Field{"code", &M::code, Range{0, INT16_MAX}},
                                    Field{"deployment", &M::deployment},
                                    Field{"sender", &M::sender, AtLeast{1}},
                                    Field{"destination", &M::destination, AtLeast{1}},
                                    Field{"session", &M::session, AtLeast{1}},
                                    Field{"call_id", &M::call_id, AtLeast{1}},
                                    Field{"completed_below", &M::completed_below, Range{0, &M::call_id}},
                                    Field{"nonce", &M::nonce},
                                    Field{"tag", &M::tag},
                                    Field{"payload_bytes", &M::payload_bytes, CountOf{&M::payload, kMaxPayloadBytes}},
                                    Field{"payload", &M::payload}};
};

template <>
struct Description<legopt_msg::chunk> {
  using M = legopt_msg::chunk;
  static constexpr auto kFull = static_cast<std::int64_t>(kChunkBytes);

  static constexpr std::int64_t Last(const M& m) { return (m.total_bytes - 1) / kFull; }
  static void IndexIsOfTheBody(const M& m, FieldCheck& check) { check.Range("index", m.index, 0, Last(m)); }
  static void IsFull(const M& m, FieldCheck& check) {
    check.Require(m.data_bytes == (m.index == Last(m) ? m.total_bytes - Last(m) * kFull : kFull),
                  "data_bytes: every chunk but the last is full");
  }

  static constexpr std::tuple kRows{Field{"total_bytes", &M::total_bytes, Range{1, kMaxMessageBytes}},
                                    Field{"hash", &M::hash},
                                    Field{"index", &M::index},
                                    Field{"ack_requested", &M::ack_requested, Range{0, 1}, &IndexIsOfTheBody},
                                    Field{"data_bytes", &M::data_bytes, CountOf{&M::data, kFull}, &IsFull},
                                    Field{"data", &M::data}};
};

template <>
struct Description<legopt_msg::chunk_ack> {
  using M = legopt_msg::chunk_ack;
  static constexpr std::tuple kRows{
      Field{"of_reply", &M::of_reply, Range{0, 1}}, Field{"complete", &M::complete, Range{0, 1}},
      Field{"reassembly", &M::reassembly},          Field{"received_below", &M::received_below, AtLeast{0}},
      Field{"received_mask", &M::received_mask},    Field{"credit", &M::credit, Range{1, kWindow}}};
};

}  // namespace legopt::bus::fields

// All fields of all messages: kFields<Message> is a std::tuple of rows with name, member and rule (field.h), in the
// order of the .lcm file. For code that displays messages (`legopt service tap`) or validates them (codec.cpp).
