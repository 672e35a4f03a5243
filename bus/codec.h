#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "bus/bus_error.h"
#include "bus/messages.h"

/// @file
/// Checked encoding and decoding of the messages of package legopt_msg.
///
/// The generated coders trust their input: decoders throw on hostile lengths and accept trailing bytes, encoders
/// believe the length field rather than the vector. Decode() therefore checks size, fingerprint and every length first,
/// catches, requires that every byte was consumed, and validates every field; Encode() validates first. What Decode()
/// returns and Encode() lets out obeys PROTOCOL.md, section 7. Thread rule: none, no state.

namespace legopt::bus {

/// Largest encoded message (an object, PROTOCOL.md section 6).
inline constexpr std::size_t kMaxMessageBytes = std::size_t{64} << 20;

/// The same for every message, by its place in AllMessages: made of the messages' fields in codec.cpp, once, rather
/// than in every file that sends or receives.
namespace codec_internal {

/// Empty when legal, else the fault (Validate).
std::string FaultOf(std::size_t message_index, const void* message);
/// Repairs what it may in `message`, then its bytes. Throws BusError (kInvalidMessage).
std::string Encode(std::size_t message_index, void* message);
/// False, with the fault in `why` unless that is null, when the bytes are not one legal message.
bool Decode(std::size_t message_index, std::string_view bytes, void* message, std::string* why);

/// Place of the message in AllMessages; what messages.def does not list does not compile.
template <class Message>
constexpr std::size_t IndexOf() {
  static_assert(kMessageIndex<Message> < AllMessages::kSize, "lcmtypes/messages.def does not list this message");
  return kMessageIndex<Message>;
}

}  // namespace codec_internal

/// Whether every field obeys its rule (message_fields.h): empty when legal, else "field: value: what is allowed".
template <class Message>
std::string Validate(const Message& message) {
  return codec_internal::FaultOf(codec_internal::IndexOf<Message>(), &message);
}

/// Sets each num_* field from its array and cuts and cleans texts that are for humans (too long, NUL or invalid UTF-8
/// must not keep a result from being delivered); in a result, infinite figures become NaN, and waypoints that are not
/// all finite are left out, with a note in verdict_detail. Then validates and encodes. Throws BusError
/// (kInvalidMessage) naming the field.
template <class Message>
std::string Encode(Message message) {
  return codec_internal::Encode(codec_internal::IndexOf<Message>(), &message);
}

/// Empty when `bytes` is not exactly one legal message; `why`, if given, then names the fault.
template <class Message>
std::optional<Message> Decode(std::string_view bytes, std::string* why = nullptr) {
  std::optional<Message> message(std::in_place);
  if (!codec_internal::Decode(codec_internal::IndexOf<Message>(), bytes, &*message, why)) message.reset();
  return message;
}

}  // namespace legopt::bus
