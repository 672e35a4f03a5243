#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "bus/message_key.h"
#include "bus/transport.h"

/// @file
/// What travels on a link: 64 bytes of header with a tag over everything, and a frame as it was heard. PROTOCOL.md,
/// section 14. Written and read in place, without allocation.

namespace legopt::bridge {

inline constexpr std::size_t kEnvelopeHeaderBytes = 64;                                          ///< of every envelope
inline constexpr std::size_t kMaxEnvelopeBytes = kEnvelopeHeaderBytes + bus::kMaxDatagramBytes;  ///< header and frame

/// What an envelope is. Upwards is from a spoke to the hub.
enum class EnvelopeKind : std::uint8_t {
  kKnock = 1,      ///< upwards: is anybody there?
  kChallenge = 2,  ///< downwards: prove that you live now; `value` is what to return
  kProof = 3,      ///< upwards: `value` is the challenge
  kAlive = 4,      ///< downwards: answers a knock or proof; `value` is its nonce
  kFrame = 5,      ///< both ways: a frame follows the header
};
/// The kinds are 1 .. kLastEnvelopeKind.
inline constexpr std::uint8_t kLastEnvelopeKind = 5;

/// The fields of an envelope, without tag and frame.
struct EnvelopeHeader {
  EnvelopeKind kind{};                   ///< what it is
  bus::Port port = bus::Port::kControl;  ///< of the bus on which the frame was heard and shall be heard
  std::int64_t deployment = 0;           ///< whose frames the link carries
  std::int64_t link = 0;                 ///< random number of this life of the spoke, > 0
  std::int64_t hub = 0;                  ///< downwards: random number of this life of the hub, > 0; upwards 0
  std::int64_t nonce = 0;                ///< counts the sender's envelopes in its life, from 1
  std::int64_t value = 0;                ///< by kind; else 0
  /// Not a field: role of the key that the tag is made with.
  bus::KeyRole role = bus::KeyRole::kOperator;
};

/// An envelope in place.
struct EnvelopeView {
  EnvelopeHeader header;                ///< as received
  std::span<const std::uint8_t> frame;  ///< within the datagram; empty but for kFrame
};

/// Why an envelope is not taken.
enum class EnvelopeFault : std::uint8_t {
  kNone,        ///< taken
  kMalformed,   ///< no envelope, or a field out of range
  kDeployment,  ///< of another deployment
  kTag,         ///< damaged, forged, or made with another key
};

/// Room for any envelope.
using EnvelopeBuffer = std::array<std::uint8_t, kMaxEnvelopeBytes>;

/// Writes an envelope around a copy of `frame` (at most kMaxDatagramBytes); returns the whole of it. If there is a key,
/// the tag is made with that of header.role, which must follow from `key`. Aborts otherwise.
std::span<const std::uint8_t> SealEnvelope(const EnvelopeHeader& header, std::span<const std::uint8_t> frame,
                                           EnvelopeBuffer& buffer, const bus::MessageKey* key);

/// Checks in this order: form, deployment, tag (made with `key` or one derived from it: the header's role says with
/// which). `envelope` points into `datagram`.
EnvelopeFault OpenEnvelope(std::span<const std::uint8_t> datagram, std::int64_t deployment, const bus::MessageKey* key,
                           EnvelopeView& envelope);

}  // namespace legopt::bridge
