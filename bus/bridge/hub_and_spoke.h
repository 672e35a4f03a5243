#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <optional>
#include <random>
#include <unordered_map>
#include <vector>

#include "bus/bridge/link.h"
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

/// Intervals of a spoke.
struct SpokeOptions {
  microseconds first_knock = std::chrono::milliseconds(100);  ///< interval between unanswered knocks; doubles ...
  microseconds last_knock = std::chrono::seconds(1);          ///< ... up to this
  microseconds keep_alive = std::chrono::seconds(2);          ///< interval between answered knocks
  microseconds silence = std::chrono::seconds(5);  ///< time without an answer after which all addresses are tried again
};

/// End of a link on a host without the server. Knocks at all addresses of the hub until one answers under the key. Then
/// it forwards frames for the server to that address and puts the server's frames on this host's bus. Trusts an answer
/// only if it contains a number that this spoke has generated since its start, and accepts each envelope of the hub
/// once. Source: PROTOCOL.md, section 14.
class Spoke final : public LinkEnd {
 public:
  /// `carrier` must outlive the spoke. `hub` are all addresses at which the hub may be reached, in the order in which
  /// they are displayed. `seed` must differ after each restart.
  Spoke(const DeploymentIdentity& membership, std::vector<LinkAddress> hub, std::uint64_t seed, Carrier& carrier,
        const SpokeOptions& options = {});

  void OnBus(bus::Port port, std::span<const std::uint8_t> datagram, microseconds now) override;
  void OnLink(LinkAddress from, std::span<const std::uint8_t> datagram, microseconds now) override;
  void Tick(microseconds now) override;
  microseconds next_deadline() const override { return next_knock_; }
  const LinkCounters& counters() const override { return counters_; }
  bool linked() const override { return chosen_.has_value(); }

  /// Address that answers; empty if none does.
  std::optional<LinkAddress> connected() const { return chosen_; }

 private:
  void HandleAlive(LinkAddress from, const EnvelopeHeader& header, microseconds now);
  void HandleDownFrame(const EnvelopeView& envelope, microseconds now);
  void KnockSoon(microseconds now);
  microseconds Jittered(microseconds duration);
  void SendUp(LinkAddress to, EnvelopeKind kind, std::int64_t value);
  void SendUp(LinkAddress to, EnvelopeHeader header, std::span<const std::uint8_t> frame);

  DeploymentIdentity membership_;
  SpokeOptions options_;
  Carrier& carrier_;
  std::vector<LinkAddress> addresses_;
  std::mt19937_64 random_;
  std::int64_t link_;
  std::int64_t nonce_ = 0;
  std::int64_t answered_ = 0;  // largest nonce that the hub has returned
  std::optional<LinkAddress> chosen_;
  std::int64_t hub_ = 0;
  bus::ReplayWindow window_{0};
  microseconds last_heard_{0};
  bool unanswered_ = false;  // whether the last knock is unanswered
  microseconds knock_interval_;
  microseconds next_knock_{0};
  LinkCounters counters_;
};

}  // namespace legopt::bridge
