#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "bus/message_key.h"
#include "bus/transport.h"

/// @file
/// What both ends of a link are made of: where datagrams go, which frames may pass which way, what is counted. No
/// sockets and no clock: both are passed in.

/// Joins the buses of hosts that share no multicast: one hub beside the server, one spoke on every other host.
namespace legopt::bridge {

using bus::microseconds;

/// Where an end of a link is reached, for LinkSocket: IPv4 address and port. Only the socket looks inside.
using LinkAddress = std::uint64_t;

/// Takes what an end of a link sends.
class Carrier {
 public:
  /// A frame for everybody on this host's bus.
  virtual void ToBus(bus::Port port, std::span<const std::uint8_t> frame) = 0;
  /// An envelope for the other end of a link.
  virtual void ToLink(LinkAddress to, std::span<const std::uint8_t> envelope) = 0;

 protected:
  ~Carrier() = default;
};

/// Whose frames, and how they are checked.
struct Membership {
  std::int64_t deployment = 0;           ///< whose frames pass; those of others are dropped
  const bus::MessageKey* key = nullptr;  ///< tags envelopes and frames; null: tags find damage only. Outlives its user

  /// Role of the key's holder.
  bus::KeyRole role() const { return key == nullptr ? bus::KeyRole::kOperator : key->role(); }
};

/// What happened to datagrams. Each is counted once.
struct PassageCounters {
  std::uint64_t forwarded_up = 0;         ///< frames on their way to the server
  std::uint64_t forwarded_down = 0;       ///< frames on their way from the server
  std::uint64_t not_for_the_bridge = 0;   ///< heard on the bus, to stay there
  std::uint64_t no_route = 0;             ///< from the bus, for a party or hub that is not known (yet)
  std::uint64_t rejected_malformed = 0;   ///< no envelope, or no frame within
  std::uint64_t rejected_deployment = 0;  ///< of another deployment
  std::uint64_t rejected_tag = 0;         ///< damaged, forged, or made with another key; envelope or frame
  std::uint64_t rejected_unproven = 0;    ///< of a link that has not proven that it lives now
  std::uint64_t rejected_replay = 0;      ///< seen before, or of an earlier life
  std::uint64_t rejected_direction = 0;   ///< a frame or envelope that may not go this way

  /// Names and values, for logs.
  std::vector<std::pair<std::string_view, std::uint64_t>> Listing() const;
};

/// One end of the links of a host. Thread rule: one thread.
class LinkEnd {
 public:
  virtual ~LinkEnd() = default;
  /// A datagram was heard on this host's bus.
  virtual void OnBus(bus::Port port, std::span<const std::uint8_t> datagram, microseconds now) = 0;
  /// A datagram came over a link.
  virtual void OnLink(LinkAddress from, std::span<const std::uint8_t> datagram, microseconds now) = 0;
  /// Does what is due by time alone.
  virtual void Tick(microseconds now) = 0;
  /// When Tick has something to do.
  virtual microseconds next_deadline() const = 0;
  /// What happened so far.
  virtual const PassageCounters& counters() const = 0;
  /// Whether the other end answers; a hub has none to wait for.
  virtual bool linked() const = 0;
};

/// Which way a frame goes, by its addresses: workers and clients call the server, the server calls nobody.
enum class Direction : std::uint8_t {
  kUp,    ///< from a worker or client to the server
  kDown,  ///< from the server to a worker or client
  kNone,  ///< nowhere: between servers, or no frame
};

/// A frame's way and, for routing, the address of the party that is not the server. Looks at nothing but the addresses.
struct Way {
  Direction direction = Direction::kNone;  ///< which way
  bus::EndpointId party = 0;               ///< sender upwards, destination downwards
};
/// The way of a datagram that claims to be a frame.
Way WayOf(std::span<const std::uint8_t> frame);

/// Role of the key that a frame is tagged with, if it is whole, of the deployment, and tagged as its members do; empty
/// else, and the cause is counted. A frame of another protocol version passes: the server has to tell its sender.
std::optional<bus::KeyRole> MayPass(std::span<const std::uint8_t> frame, const Membership& membership,
                                    PassageCounters& counters);

}  // namespace legopt::bridge
