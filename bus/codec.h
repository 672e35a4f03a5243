// Checked encoding and decoding of the messages of package legopt_msg.
//
// The generated coders trust their input: decoders throw on hostile lengths and accept trailing bytes, encoders believe
// the length field rather than the vector. Decode() therefore checks size, fingerprint and
// every length first, catches, requires that every byte was consumed, and validates every field; Encode() validates
// first. What Decode() returns and Encode() lets out obeys PROTOCOL.md, section 7. Thread rule: none, no state.
#pragma once

#include <cstdint>
#include <exception>
#include <optional>
#include <string>
#include <string_view>

#include "bus/bus_error.h"
#include "bus/layout.h"
#include "bus/validate.h"

namespace legopt::bus {

// Largest encoded message (an object, PROTOCOL.md section 6).
inline constexpr std::size_t kMaxMessageBytes = std::size_t{64} << 20;

// Prepares (validate.h: counts, free texts), validates and encodes. Throws BusError (kInvalidMessage) naming the field.
template <class Message>
std::string Encode(Message message) {
  PrepareForWire(message);
  if (const std::string fault = Validate(message); !fault.empty()) {
    throw BusError(BusErrorCode::kInvalidMessage, std::string(Message::getTypeName()) + ": " + fault);
  }
  std::string bytes(static_cast<std::size_t>(message.getEncodedSize()), '\0');
  if (bytes.size() > kMaxMessageBytes || message.encode(bytes.data(), 0, static_cast<int>(bytes.size())) < 0) {
    throw BusError(BusErrorCode::kInvalidMessage, std::string(Message::getTypeName()) + ": too large to encode (" +
                                                      std::to_string(bytes.size()) + " bytes)");
  }
  return bytes;
}

// Empty when `bytes` is not exactly one legal message; `why`, if given, then names the fault.
template <class Message>
std::optional<Message> Decode(std::string_view bytes, std::string* why = nullptr) {
  const auto fail = [why](std::string text) -> std::optional<Message> {
    if (why != nullptr) *why = std::string(Message::getTypeName()) + ": " + std::move(text);
    return std::nullopt;
  };
  constexpr std::size_t kFingerprintBytes = 8;
  if (bytes.size() < kFingerprintBytes) return fail("shorter than a fingerprint");
  if (bytes.size() > kMaxMessageBytes) return fail("above " + std::to_string(kMaxMessageBytes) + " bytes");
  std::uint64_t fingerprint = 0;
  for (std::size_t i = 0; i < kFingerprintBytes; ++i) {
    fingerprint = (fingerprint << 8) | static_cast<std::uint8_t>(bytes[i]);
  }
  if (fingerprint != static_cast<std::uint64_t>(Message::getHash())) return fail("another message type or revision");
  if (!LayoutFits(kLayout<Message>, bytes.substr(kFingerprintBytes))) {
    return fail("truncated, followed by something, or with an illegal length");
  }
  try {
    Message message;
    const int consumed = message.decode(bytes.data(), 0, static_cast<int>(bytes.size()));
    if (consumed < 0 || static_cast<std::size_t>(consumed) != bytes.size()) return fail("undecodable");
    if (std::string fault = Validate(message); !fault.empty()) return fail(std::move(fault));
    return message;
  } catch (const std::exception&) {
    return fail("undecodable");
  }
}

}  // namespace legopt::bus
