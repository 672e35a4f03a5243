#pragma once

#include <cstdint>
#include <optional>
#include <random>
#include <vector>

#include "bus/bridge/envelope.h"
#include "bus/bridge/link_end.h"
#include "bus/replay_guard.h"

namespace legopt::bridge {

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
