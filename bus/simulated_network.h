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
/// A seeded network in virtual time: the same Transport interface, every misfortune on demand, the same history each
/// time.
///
/// Use: make a SimulatedNetwork, then one SimulatedTransport per party. Poll() of a simulated transport never waits: it
/// delivers what is due at the network's now(). The driver polls every party and then advances time:
///     while (!done) { for (auto* e : endpoints) e->Poll(0us); network.AdvanceTo(earliest timer or delivery); }
/// Run() does that for endpoints.
///
/// Thread rule: one thread for a network and all its transports.

namespace legopt::bus {

class Endpoint;
class SimulatedTransport;

/// Probabilities are per datagram and receiver, each in [0, 1]. The defaults are a perfect, instant network.
struct Misfortune {
  double drop = 0;            ///< never delivered
  double duplicate = 0;       ///< delivered once more, with its own delay
  double reorder = 0;         ///< held back by an extra delay of up to `reorder_delay`
  double corrupt = 0;         ///< 1 - 3 random bytes changed
  double truncate = 0;        ///< cut at a random length
  microseconds min_delay{0};  ///< of every datagram
  microseconds max_delay{0};  ///< of every datagram, >= min_delay; uniform between the two
  /// Longest extra delay.
  microseconds reorder_delay{50'000};
  /// Datagrams that may wait for a party, those under way included; more are lost, as in a kernel's receive buffer.
  std::size_t receive_buffer = SIZE_MAX;

  /// Standard chaos (docs/reliability.md#the-figures): 20 % loss, 5 % duplication, 10 % reordering, 0 - 50 ms delay.
  static Misfortune StandardChaos();
};

/// The wire, and the time, of all parties.
class SimulatedNetwork {
 public:
  /// Equal seeds and equal use give equal histories.
  explicit SimulatedNetwork(std::uint64_t seed, const Misfortune& misfortune = {});
  ~SimulatedNetwork();
  SimulatedNetwork(const SimulatedNetwork&) = delete;
  SimulatedNetwork& operator=(const SimulatedNetwork&) = delete;

  microseconds now() const { return now_; }                                        ///< virtual time since the start
  void set_misfortune(const Misfortune& misfortune) { misfortune_ = misfortune; }  ///< for what is sent from now on

  /// Moves time forward (never back) to `time`; delivers nothing by itself.
  void AdvanceTo(microseconds time);
  /// AdvanceTo the time that comes `duration` later.
  void Advance(microseconds duration) { AdvanceTo(now_ + duration); }
  /// When the earliest datagram under way is due; empty when none is.
  std::optional<microseconds> next_delivery() const;

  /// Parties of different partitions do not hear each other; all start in 0. What is under way still arrives.
  void SetPartition(const SimulatedTransport& transport, int partition);

  /// As with a socket filter at every party: a datagram reaches only the party that its frame is for. A fleet is
  /// simulated in a time that grows with what is said, not with who could hear it. To be set before anything is sent.
  void SetFiltered() { filtered_ = true; }

  /// Puts a datagram on the wire as if a stranger had sent it.
  void Inject(Port port, std::span<const std::uint8_t> datagram);
  /// Called for every datagram sent, before misfortune strikes; for size checks and recordings.
  void SetTap(std::function<void(Port, std::span<const std::uint8_t>)> tap) { tap_ = std::move(tap); }

  /// Polls the endpoints and advances time until `done` returns true or `limit` of virtual time has passed since the
  /// call; returns whether `done` was reached.
  bool Run(std::span<Endpoint* const> endpoints, const std::function<bool()>& done, microseconds limit);

 private:
  friend class SimulatedTransport;
  struct Station;  // one attached transport
  using Bytes = std::shared_ptr<const std::vector<std::uint8_t>>;

  void Send(const Station* from, Port port, std::span<const std::uint8_t> datagram);
  void SendTo(Station& to, Port port, const Bytes& bytes);
  void Deliver(Station& to, Port port, const Bytes& bytes);
  Bytes Injure(const Bytes& bytes);
  bool Chance(double probability);
  std::uint64_t Below(std::uint64_t bound);

  std::mt19937_64 random_;
  Misfortune misfortune_;
  microseconds now_{0};
  std::vector<std::unique_ptr<Station>> stations_;
  bool filtered_ = false;
  std::map<EndpointId, Station*> station_of_;
  std::function<void(Port, std::span<const std::uint8_t>)> tap_;
};

/// One party's end of the network.
class SimulatedTransport final : public Transport {
 public:
  /// `network` must outlive the transport. Transports of one network with different deployments hear each other and
  /// ignore it.
  explicit SimulatedTransport(SimulatedNetwork& network, std::int64_t deployment = 1,
                              std::shared_ptr<const MessageKey> key = nullptr);
  ~SimulatedTransport() override;

  void Send(Port port, std::span<const std::uint8_t> datagram) override;
  void SetReceiver(DatagramReceiver* receiver, EndpointId self) override;
  int Poll(std::span<pollfd> extra, microseconds max_wait) override;
  microseconds now() const override;
  std::int64_t deployment() const override;
  const MessageKey* key() const override { return key_.get(); }
  /// kernel_drops: the full receive buffer; the rest as sent and delivered.
  TransportCounters counters() const override;

  /// Poll delivers at most `datagrams` from now on, as to a party that takes its time for each; the rest waits in its
  /// receive buffer.
  void LimitPolls(std::size_t datagrams) { most_per_poll_ = datagrams; }
  /// When this party's next datagram is due, perhaps in the past; empty when none is under way.
  std::optional<microseconds> next_arrival() const;

 private:
  friend class SimulatedNetwork;
  SimulatedNetwork* network_;
  SimulatedNetwork::Station* station_;
  std::int64_t deployment_;
  std::shared_ptr<const MessageKey> key_;
  std::size_t most_per_poll_ = SIZE_MAX;
};

}  // namespace legopt::bus
