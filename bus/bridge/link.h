#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "bus/message_key.h"
#include "bus/transport.h"

namespace legopt::bridge {

/// @file
/// Envelopes, the datagrams on a link: a header of 64 bytes with a tag over the whole envelope, and an unchanged frame.
/// PROTOCOL.md, section 14. Encoded and decoded in place, without allocation.

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

// Common parts of both ends of a link: addresses, permitted directions of frames, counters. Uses no sockets and no
// clock; both are passed in.

/// Connects the buses of hosts that share no multicast: one hub next to the server, one spoke on every other host.

using bus::microseconds;

/// Address of an end of a link, for LinkSocket: IPv4 address and port. Only the socket interprets it.
using LinkAddress = std::uint64_t;

/// Sends the datagrams of an end of a link.
class Carrier {
 public:
  /// Sends a frame to all parties on this host's bus.
  virtual void ToBus(bus::Port port, std::span<const std::uint8_t> frame) = 0;
  /// Sends an envelope to the other end of a link.
  virtual void ToLink(LinkAddress to, std::span<const std::uint8_t> envelope) = 0;

 protected:
  ~Carrier() = default;
};

/// Deployment to which a link end belongs, and its key.
struct DeploymentIdentity {
  std::int64_t deployment = 0;           ///< frames of other deployments are dropped
  const bus::MessageKey* key = nullptr;  ///< null: tags only detect damage. Must outlive its user

  /// Role of the key; kOperator without a key.
  bus::KeyRole role() const { return key == nullptr ? bus::KeyRole::kOperator : key->role(); }
};

/// Counters of datagrams. Each datagram is counted once.
struct LinkCounters {
  std::uint64_t forwarded_up = 0;         ///< frames forwarded to the server
  std::uint64_t forwarded_down = 0;       ///< frames forwarded from the server
  std::uint64_t not_for_the_bridge = 0;   ///< received from the bus and not forwarded
  std::uint64_t no_route = 0;             ///< received from the bus for a party or hub that is not known (yet)
  std::uint64_t rejected_malformed = 0;   ///< not an envelope, or no frame inside
  std::uint64_t rejected_deployment = 0;  ///< another deployment
  std::uint64_t rejected_tag = 0;         ///< envelope or frame damaged, forged, or made with another key
  std::uint64_t rejected_unproven = 0;    ///< received on a link without a proof
  std::uint64_t rejected_replay = 0;      ///< repeated, or from before a restart
  std::uint64_t rejected_direction = 0;   ///< frame or envelope in a direction that is not permitted

  /// Names and values, for logs.
  std::vector<std::pair<std::string_view, std::uint64_t>> Listing() const;
};

/// One end of a host's links. Thread rule: one thread.
class LinkEnd {
 public:
  virtual ~LinkEnd() = default;
  /// Processes a datagram received from this host's bus.
  virtual void OnBus(bus::Port port, std::span<const std::uint8_t> datagram, microseconds now) = 0;
  /// Processes a datagram received on a link.
  virtual void OnLink(LinkAddress from, std::span<const std::uint8_t> datagram, microseconds now) = 0;
  /// Performs actions that are due at `now`.
  virtual void Tick(microseconds now) = 0;
  /// Next time for Tick.
  virtual microseconds next_deadline() const = 0;
  /// Counters since construction.
  virtual const LinkCounters& counters() const = 0;
  /// Whether the other end answers; always true for a hub.
  virtual bool linked() const = 0;
};

/// Direction of a frame, according to its addresses: workers and clients call the server, the server calls no other
/// party.
enum class Direction : std::uint8_t {
  kUp,    ///< towards the server
  kDown,  ///< towards a worker or client
  kNone,  ///< not forwarded: between servers, or not a frame
};

/// Direction of a frame and, for routing, the address of the party that is not the server. Determined by the addresses
/// only.
struct FrameRoute {
  Direction direction = Direction::kNone;
  bus::EndpointId party = 0;  ///< sender if upwards, destination if downwards
};
/// Returns the direction of a datagram that should be a frame.
FrameRoute FrameRouteOf(std::span<const std::uint8_t> frame);

/// Returns the role of the key that made the frame's tag if the frame is complete, of this deployment, and its tag is
/// valid. Otherwise counts the cause and returns nothing. Frames of another protocol version pass, so that the server
/// can inform their sender.
std::optional<bus::KeyRole> CheckFrameTag(std::span<const std::uint8_t> frame, const DeploymentIdentity& membership,
                                          LinkCounters& counters);

}  // namespace legopt::bridge
