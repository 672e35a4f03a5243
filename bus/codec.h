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
/// The generated coders trust their input: decoders throw on hostile lengths and accept trailing bytes, encoders use
/// the length field, not the size of the vector. Decode() therefore first checks size, fingerprint and every length. It
/// catches exceptions, requires that every byte was consumed, and validates every field. Encode() validates before
/// encoding. All messages that Decode() returns and Encode() accepts satisfy PROTOCOL.md, section 7. Thread rule: none,
/// no state.

namespace legopt::bus {

/// Largest encoded message (an object, PROTOCOL.md section 6).
inline constexpr std::size_t kMaxMessageBytes = std::size_t{64} << 20;

/// Coding functions by the message's index in AllMessages. They are instantiated only once, in codec.cpp, instead of in
/// every file that sends or receives messages.
namespace codec_internal {

/// Returns the first fault (see Validate); empty if the message is valid.
std::string FaultOf(std::size_t message_index, const void* message);
/// Applies the sender's corrections to `message` and encodes it. Throws BusError (kInvalidMessage).
std::string Encode(std::size_t message_index, void* message);
/// Returns false if the bytes are not exactly one valid message; stores the fault in `why` unless it is null.
bool Decode(std::size_t message_index, std::string_view bytes, void* message, std::string* why);

/// Returns the index of the message in AllMessages. Messages missing in messages.def cause a compile error.
template <class Message>
constexpr std::size_t IndexOf() {
  static_assert(kMessageIndex<Message> < AllMessages::kSize, "lcmtypes/messages.def does not list this message");
  return kMessageIndex<Message>;
}

}  // namespace codec_internal

/// Checks every field against its rule (message_fields.h). Returns the fault as "FIELD: VALUE: RULE", or an empty text
/// if the message is valid.
template <class Message>
std::string Validate(const Message& message) {
  return codec_internal::FaultOf(codec_internal::IndexOf<Message>(), &message);
}

/// Corrects a message, then validates and encodes it. Corrections: each num_* field is set from its array; texts for
/// humans are truncated and cleaned, because text that is too long, contains NUL or is invalid UTF-8 must not prevent
/// delivery of a result; in a result, infinite numbers become NaN, and waypoints with non-finite values are removed
/// with a note in verdict_detail. Throws BusError (kInvalidMessage) naming the field.
template <class Message>
std::string Encode(Message message) {
  return codec_internal::Encode(codec_internal::IndexOf<Message>(), &message);
}

/// Returns nothing if `bytes` is not exactly one valid message; stores the fault in `why` if that is given.
template <class Message>
std::optional<Message> Decode(std::string_view bytes, std::string* why = nullptr) {
  std::optional<Message> message(std::in_place);
  if (!codec_internal::Decode(codec_internal::IndexOf<Message>(), bytes, &*message, why)) message.reset();
  return message;
}

}  // namespace legopt::bus
