// Hosts without common multicast, joined by hub and spokes over a faulty link in virtual time. One host has the
// server, the others have a caller each. Every frame that leaves a bridge is checked against the protocol's rules.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bus/bridge/hub_and_spoke.h"
#include "bus/endpoint.h"
#include "bus/message_key.h"
#include "tests/doubles/simulated_network.h"

namespace legopt::bridge {

using Bytes = std::vector<std::uint8_t>;

// Carries envelopes between addresses, injects faults, and records everything sent.
class FaultyWire {
 public:
  struct Letter {
    LinkAddress from = 0, to = 0;
    Bytes bytes;
  };

  explicit FaultyWire(std::uint64_t seed) : random_(seed) {}
  void set_fault_model(const bus::FaultModel& fault_model) { fault_model_ = fault_model; }
  void Send(LinkAddress from, LinkAddress to, std::span<const std::uint8_t> bytes, microseconds now);
  // Returns everything due at `now`, in order.
  std::vector<Letter> TakeDue(microseconds now);
  std::optional<microseconds> next() const;
  const std::vector<Letter>& recorded() const { return recorded_; }

 private:
  bool Chance(double probability) { return static_cast<double>(random_() >> 11U) * 0x1.0p-53 < probability; }

  std::mt19937_64 random_;
  bus::FaultModel fault_model_;
  std::multimap<microseconds, Letter> under_way_;
  std::vector<Letter> recorded_;
};

// A host: its bus, a party on the bus, and its end of the link.
class Host final : private Carrier, private bus::DatagramReceiver {
 public:
  using Watch = std::function<void(const Host&, bus::Port, std::span<const std::uint8_t>)>;

  Host(FaultyWire& wire, LinkAddress address, std::uint64_t seed, std::shared_ptr<const bus::MessageKey> key);

  void BecomeHub(std::uint64_t seed, const HubOptions& options = {});
  void BecomeSpoke(std::vector<LinkAddress> hub, std::uint64_t seed);
  void EndBridge() { end_.reset(); }
  void MoveTo(LinkAddress address) { address_ = address; }
  void AddParty(bus::EndpointId id, std::uint64_t seed);

  // Does everything due now.
  void Work(microseconds now);
  void Take(const FaultyWire::Letter& letter, microseconds now);
  std::optional<microseconds> next() const;

  // Sets a function that receives each frame the bridge puts on this host's bus.
  void set_watch(Watch watch) { watch_ = std::move(watch); }
  bus::SimulatedNetwork& network() { return network_; }
  bus::Endpoint& party() { return *party_; }
  bus::EndpointId party_id() const { return party_id_; }
  LinkAddress address() const { return address_; }
  Hub& hub() { return dynamic_cast<Hub&>(*end_); }
  Spoke& spoke() { return dynamic_cast<Spoke&>(*end_); }
  bool bridged() const { return end_ != nullptr; }
  DeploymentIdentity membership() const { return {bus_.deployment(), bus_.key()}; }

 private:
  void OnDatagram(bus::Port port, std::span<const std::uint8_t> datagram) noexcept override;
  void ToBus(bus::Port port, std::span<const std::uint8_t> frame) override;
  void ToLink(LinkAddress to, std::span<const std::uint8_t> envelope) override;

  bus::SimulatedNetwork network_;
  FaultyWire& wire_;
  LinkAddress address_;
  std::shared_ptr<const bus::MessageKey> key_;
  bus::SimulatedTransport bus_;
  std::unique_ptr<bus::SimulatedTransport> party_transport_;
  std::unique_ptr<bus::Endpoint> party_;
  bus::EndpointId party_id_ = 0;
  std::unique_ptr<LinkEnd> end_;
  Watch watch_;
};

// Joined hosts. Host 0 has the server, which answers each call with its body in angle brackets.
class JoinedHosts {
 public:
  static constexpr LinkAddress kHubAddress = 1000;
  static constexpr bus::EndpointId kFirstCaller = bus::EndpointId{1} << 40;

  JoinedHosts(int callers, std::uint64_t seed, const std::shared_ptr<const bus::MessageKey>& key);

  Host& server() { return *hosts_.front(); }
  Host& caller(int i) { return *hosts_.at(static_cast<std::size_t>(i) + 1); }
  FaultyWire& wire() { return wire_; }
  microseconds now() const { return now_; }
  int handled() const { return handled_; }

  // Restarts the hub, and the spoke of caller `i` at a new address.
  void StartHub();
  void StartSpoke(int i);
  // Runs until `done`; returns false if `limit` passes first.
  bool RunUntil(const std::function<bool()>& done, microseconds limit);
  // Calls the server from the host of caller `i` and waits. Returns the answer; empty if none arrives within `limit`.
  std::string CallAndWait(int i, const std::string& body, microseconds limit = std::chrono::seconds(30));
  // Sends from a stranger's address.
  void Inject(LinkAddress to, std::span<const std::uint8_t> bytes) { wire_.Send(kStranger, to, bytes, now_); }

  // Returns the forbidden action of a bridge that was recorded; empty if none.
  const std::string& first_violation() const { return first_violation_; }

  static constexpr LinkAddress kStranger = 9999;

 private:
  void Watch(const Host& host, bus::Port port, std::span<const std::uint8_t> frame);
  void Step();

  FaultyWire wire_;
  std::mt19937_64 random_;
  microseconds now_{0};
  std::vector<std::unique_ptr<Host>> hosts_;
  LinkAddress next_address_ = 2000;
  std::set<std::pair<bus::EndpointId, std::int64_t>> carried_up_;  // sender, nonce
  int handled_ = 0;
  std::string first_violation_;
};

// Returns a key for tests, which is not secret.
std::shared_ptr<const bus::MessageKey> BridgeTestKey(std::uint8_t first_byte = 0);

}  // namespace legopt::bridge
