#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "bus/message_key.h"
#include "bus/transport.h"

/// @file
/// Envelopes, the datagrams on a link: a header of 64 bytes with a tag over the whole envelope, and an unchanged frame.
/// PROTOCOL.md, section 14. Encoded and decoded in place, without allocation.

namespace legopt::bridge {

inline constexpr std::size_t kEnvelopeHeaderBytes = 64;  ///< size of an envelope without its frame
inline constexpr std::size_t kMaxEnvelopeBytes = kEnvelopeHeaderBytes + bus::kMaxDatagramBytes;  ///< header and frame

/// Kind of an envelope. Up is from a spoke to the hub.
enum class EnvelopeKind : std::uint8_t {
  kKnock = 1,      ///< request for an answer, up
  kChallenge = 2,  ///< number that the link must return in a proof, down
  kProof = 3,      ///< answer to a challenge, up; `value` is the challenge
  kAlive = 4,      ///< answer to a knock or proof, down; `value` is its nonce
  kFrame = 5,      ///< envelope with a frame, in both directions
};
/// Largest kind; the kinds are 1 .. kLastEnvelopeKind.
inline constexpr std::uint8_t kLastEnvelopeKind = 5;

/// Fields of an envelope, without tag and frame.
struct EnvelopeHeader {
  EnvelopeKind kind{};
  bus::Port port = bus::Port::kControl;  ///< port of the bus on which the frame was received and must be sent
  std::int64_t deployment = 0;           ///< deployment of the frames
  std::int64_t link = 0;                 ///< random number of the spoke, > 0, new after each restart
  std::int64_t hub = 0;                  ///< random number of the hub, > 0, new after each restart; up: 0
  std::int64_t nonce = 0;                ///< number of the envelope among those of its sender since its start, from 1
  std::int64_t value = 0;                ///< meaning depends on the kind; 0 if unused
  /// Role of the key that made the tag; not a field of the envelope.
  bus::KeyRole role = bus::KeyRole::kOperator;
};

/// Decoded envelope that refers to its datagram.
struct EnvelopeView {
  EnvelopeHeader header;
  std::span<const std::uint8_t> frame;  ///< part of the datagram; empty except for kFrame
};

/// Reason for rejecting an envelope.
enum class EnvelopeFault : std::uint8_t {
  kNone,        ///< accepted
  kMalformed,   ///< not an envelope, or a field out of range
  kDeployment,  ///< another deployment
  kTag,         ///< damaged, forged, or made with another key
};

/// Buffer for any envelope.
using EnvelopeBuffer = std::array<std::uint8_t, kMaxEnvelopeBytes>;

/// Writes an envelope with a copy of `frame` (at most kMaxDatagramBytes) and returns the whole envelope. With a key,
/// the tag is made with the key of header.role, which must be `key` or derived from it. Aborts otherwise.
std::span<const std::uint8_t> SealEnvelope(const EnvelopeHeader& header, std::span<const std::uint8_t> frame,
                                           EnvelopeBuffer& buffer, const bus::MessageKey* key);

/// Decodes an envelope in `datagram` and checks it in this order: form, deployment, tag. Sets the header's role to that
/// of the key that made the tag: `key` or one derived from it.
EnvelopeFault OpenEnvelope(std::span<const std::uint8_t> datagram, std::int64_t deployment, const bus::MessageKey* key,
                           EnvelopeView& envelope);

}  // namespace legopt::bridge
