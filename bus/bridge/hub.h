#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <unordered_map>

#include "bus/bridge/envelope.h"
#include "bus/bridge/link_end.h"
#include "bus/replay_guard.h"

namespace legopt::bridge {

/// Limits of a hub.
struct HubOptions {
  std::size_t max_links = 16'384;   ///< spokes remembered; the one silent for the longest time is dropped first
  std::size_t max_routes = 65'536;  ///< parties remembered; the one silent for the longest time is dropped first
  microseconds route_life = std::chrono::minutes(2);  ///< maximum silence of a party; a worker sends twice a second
};

/// End of all links on the server's host. Puts frames for the server that arrive on a link on the bus. Sends frames of
/// the server to the link on which their destination was last heard, or drops them. Trusts a link after it has returned
/// this hub's challenge under the key, and accepts each of its envelopes once (bus/replay_guard.h). Only such envelopes
/// set routes. Datagrams without a valid tag are not answered. Source: PROTOCOL.md, section 14.
class Hub final : public LinkEnd {
 public:
  /// `carrier` must outlive the hub. `seed` must differ after each restart: the challenge and the hub's number are
  /// derived from it.
  Hub(const DeploymentIdentity& membership, std::uint64_t seed, Carrier& carrier, const HubOptions& options = {});

  void OnBus(bus::Port port, std::span<const std::uint8_t> datagram, microseconds now) override;
  void OnLink(LinkAddress from, std::span<const std::uint8_t> datagram, microseconds now) override;
  void Tick(microseconds now) override;
  microseconds next_deadline() const override;
  const LinkCounters& counters() const override { return counters_; }
  bool linked() const override { return true; }

  std::size_t num_routes() const { return routes_.size(); }  ///< number of parties that can be reached now

 private:
  struct Route {
    LinkAddress address = 0;
    std::int64_t link = 0;
    bus::KeyRole link_role{};   // role of the spoke's key
    bus::KeyRole party_role{};  // role of the party's key; frames of other roles neither set nor use this route
    microseconds heard{0};
    std::list<bus::EndpointId>::iterator recency;
  };

  void HandleUpFrame(LinkAddress from, const EnvelopeView& envelope, microseconds now);
  bool UpdateRoute(bus::EndpointId party, const Route& route);
  void EvictOldestRoute();
  void Answer(LinkAddress to, const EnvelopeHeader& question, EnvelopeKind kind, std::int64_t value);
  void SendDown(LinkAddress to, EnvelopeHeader header, std::span<const std::uint8_t> frame);

  DeploymentIdentity membership_;
  HubOptions options_;
  Carrier& carrier_;
  bus::ReplayGuard guard_;
  std::int64_t life_;
  std::int64_t nonce_ = 0;
  std::unordered_map<bus::EndpointId, Route> routes_;
  std::list<bus::EndpointId> recency_;  // silent for the longest time first
  LinkCounters counters_;
};

}  // namespace legopt::bridge
