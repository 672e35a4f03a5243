#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include "bus/message_key.h"
#include "bus/transport.h"

/// @file
/// Seeded network in virtual time behind the Transport interface. Injects configurable faults; every run with the same
/// seed is identical.
///
/// Use: create a SimulatedNetwork, then one SimulatedTransport per party. Poll() of a simulated transport never waits:
/// it delivers the datagrams that are due at the network's now(). The driver polls every party and then advances time:
///     while (!done) { for (auto* e : endpoints) e->Poll(0us); network.AdvanceTo(earliest timer or delivery); }
/// Run() does this for endpoints.
///
/// Thread rule: one thread for a network and all its transports.

namespace legopt::bus {

class Endpoint;
class SimulatedTransport;

/// Fault probabilities per datagram and receiver, each in [0, 1]. The defaults are a perfect network without delay.
struct FaultModel {
  double drop = 0;            ///< never delivered
  double duplicate = 0;       ///< delivered a second time, with an independent delay
  double reorder = 0;         ///< delayed additionally by up to `reorder_delay`
  double corrupt = 0;         ///< 1 - 3 random bytes changed
  double truncate = 0;        ///< truncated to a random length
  microseconds min_delay{0};  ///< minimum delay of a datagram
  microseconds max_delay{0};  ///< maximum delay, >= min_delay; uniformly distributed
  /// Longest extra delay.
  microseconds reorder_delay{50'000};
  /// Maximum number of datagrams queued for a party, including those in flight. More are lost, as in a kernel's receive
  /// buffer.
  std::size_t receive_buffer = SIZE_MAX;

  /// Returns the standard faults (docs/explanation/reliability.md#the-figures): 20 % loss, 5 % duplication, 10 %
  /// reordering, 0 - 50 ms delay.
  static FaultModel StandardChaos();
};

/// Simulated network and clock of all parties.
class SimulatedNetwork {
 public:
  /// Equal seeds and equal calls give equal histories.
  explicit SimulatedNetwork(std::uint64_t seed, const FaultModel& fault_model = {});
  ~SimulatedNetwork();
  SimulatedNetwork(const SimulatedNetwork&) = delete;
  SimulatedNetwork& operator=(const SimulatedNetwork&) = delete;

  microseconds now() const { return now_; }                                            ///< virtual time since the start
  void set_fault_model(const FaultModel& fault_model) { fault_model_ = fault_model; }  ///< affects future datagrams

  /// Advances the virtual time to `time`, never backwards. Delivers nothing.
  void AdvanceTo(microseconds time);
  /// Advances the virtual time by `duration`.
  void Advance(microseconds duration) { AdvanceTo(now_ + duration); }
  /// Time at which the earliest datagram in flight is due; empty if there is none.
  std::optional<microseconds> next_delivery() const;

  /// Moves a party to a partition. Parties in different partitions do not receive from each other; all start in 0.
  /// Datagrams in flight still arrive.
  void SetPartition(const SimulatedTransport& transport, int partition);

  /// Simulates a socket filter at every party: a datagram is delivered only to the destination of its frame. The
  /// simulation time of a fleet then grows with the number of datagrams, not with that of possible receivers. Must be
  /// called before anything is sent.
  void SetFiltered() { filtered_ = true; }

  /// Sends a datagram that comes from no attached party.
  void Inject(Port port, std::span<const std::uint8_t> datagram);
  /// Sets a function that is called for every datagram sent, before faults are applied; for size checks and recordings.
  void SetTap(std::function<void(Port, std::span<const std::uint8_t>)> tap) { tap_ = std::move(tap); }

  /// Polls the endpoints and advances time until `done` returns true or `limit` of virtual time has passed. Returns
  /// whether `done` returned true.
  bool Run(std::span<Endpoint* const> endpoints, const std::function<bool()>& done, microseconds limit);

 private:
  friend class SimulatedTransport;
  struct SimulatedNode;  // one attached transport
  using Bytes = std::shared_ptr<const std::vector<std::uint8_t>>;

  void Send(const SimulatedNode* from, Port port, std::span<const std::uint8_t> datagram);
  void SendTo(SimulatedNode& to, Port port, const Bytes& bytes);
  void Deliver(SimulatedNode& to, Port port, const Bytes& bytes);
  Bytes CorruptDatagram(const Bytes& bytes);
  bool Chance(double probability);
  std::uint64_t Below(std::uint64_t bound);

  std::mt19937_64 random_;
  FaultModel fault_model_;
  microseconds now_{0};
  std::vector<std::unique_ptr<SimulatedNode>> simulated_nodes_;
  bool filtered_ = false;
  std::map<EndpointId, SimulatedNode*> simulated_node_of_;
  std::function<void(Port, std::span<const std::uint8_t>)> tap_;
};

/// Transport of one party.
class SimulatedTransport final : public Transport {
 public:
  /// `network` must outlive the transport. Transports with different deployments receive each other's datagrams and
  /// ignore them.
  explicit SimulatedTransport(SimulatedNetwork& network, std::int64_t deployment = 1,
                              std::shared_ptr<const MessageKey> key = nullptr);
  ~SimulatedTransport() override;

  void Send(Port port, std::span<const std::uint8_t> datagram) override;
  void SetReceiver(DatagramReceiver* receiver, EndpointId self) override;
  int Poll(std::span<pollfd> extra, microseconds max_wait) override;
  microseconds now() const override;
  std::int64_t deployment() const override;
  const MessageKey* key() const override { return key_.get(); }
  /// kernel_drops counts overflows of the receive buffer; the other counters work as usual.
  TransportCounters counters() const override;

  /// Limits the datagrams delivered by each Poll, to simulate a slow party. The others wait in its receive buffer.
  void LimitPolls(std::size_t datagrams) { most_per_poll_ = datagrams; }
  /// Time at which this party's next datagram is due, possibly in the past; empty if none is in flight.
  std::optional<microseconds> next_arrival() const;

 private:
  friend class SimulatedNetwork;
  SimulatedNetwork* network_;
  SimulatedNetwork::SimulatedNode* simulated_node_;
  std::int64_t deployment_;
  std::shared_ptr<const MessageKey> key_;
  std::size_t most_per_poll_ = SIZE_MAX;
};

}  // namespace legopt::bus
