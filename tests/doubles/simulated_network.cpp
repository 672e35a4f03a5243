#include "tests/doubles/simulated_network.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <utility>

#include "bus/endpoint.h"

namespace legopt::bus {

namespace {

// Returns bytes 32 .. 39 of a frame (PROTOCOL.md, section 3); 0, which no party uses, if it is too short.
EndpointId DestinationOf(std::span<const std::uint8_t> datagram) {
  constexpr std::size_t kOffset = 32;
  constexpr unsigned kBitsPerByte = 8;
  if (datagram.size() < kOffset + sizeof(EndpointId)) return 0;
  std::uint64_t destination = 0;
  for (const std::uint8_t byte : datagram.subspan(kOffset, sizeof(EndpointId))) {
    destination = (destination << kBitsPerByte) | byte;
  }
  return static_cast<EndpointId>(destination);
}

}  // namespace

struct SimulatedNetwork::SimulatedNode {
  DatagramReceiver* receiver = nullptr;
  int partition = 0;
  TransportCounters counters;
  std::multimap<microseconds, std::pair<Port, Bytes>> inbox;  // datagrams with equal times keep the order of sending
};

FaultModel FaultModel::StandardChaos() {
  FaultModel chaos;
  chaos.drop = 0.2;
  chaos.duplicate = 0.05;
  chaos.reorder = 0.1;
  chaos.max_delay = std::chrono::milliseconds(50);
  return chaos;
}

SimulatedNetwork::SimulatedNetwork(std::uint64_t seed, const FaultModel& fault_model)
    : random_(seed), fault_model_(fault_model) {}
SimulatedNetwork::~SimulatedNetwork() = default;

// Does not use std:: distributions, because their results differ between standard libraries.
bool SimulatedNetwork::Chance(double probability) {
  constexpr double kUnit = 1.0 / 9007199254740992.0;  // 2^-53
  if (probability <= 0) return false;
  return static_cast<double>(random_() >> 11U) * kUnit < probability;
}

std::uint64_t SimulatedNetwork::Below(std::uint64_t bound) { return bound == 0 ? 0 : random_() % bound; }

void SimulatedNetwork::AdvanceTo(microseconds time) { now_ = std::max(now_, time); }

std::optional<microseconds> SimulatedNetwork::next_delivery() const {
  std::optional<microseconds> earliest;
  for (const auto& simulated_node : simulated_nodes_) {
    if (simulated_node->inbox.empty()) continue;
    const microseconds due = simulated_node->inbox.begin()->first;
    if (!earliest || due < *earliest) earliest = due;
  }
  return earliest;
}

void SimulatedNetwork::SetPartition(const SimulatedTransport& transport, int partition) {
  transport.simulated_node_->partition = partition;
}

void SimulatedNetwork::Inject(Port port, std::span<const std::uint8_t> datagram) { Send(nullptr, port, datagram); }

void SimulatedNetwork::Send(const SimulatedNode* from, Port port, std::span<const std::uint8_t> datagram) {
  if (tap_) tap_(port, datagram);
  const auto reached = [from](const SimulatedNode& to) { return from == nullptr || from->partition == to.partition; };
  const auto bytes = std::make_shared<const std::vector<std::uint8_t>>(datagram.begin(), datagram.end());
  if (filtered_) {
    const auto to = simulated_node_of_.find(DestinationOf(datagram));
    if (to != simulated_node_of_.end() && reached(*to->second)) SendTo(*to->second, port, bytes);
    return;
  }
  for (const auto& simulated_node : simulated_nodes_) {
    if (reached(*simulated_node)) SendTo(*simulated_node, port, bytes);
  }
}

void SimulatedNetwork::SendTo(SimulatedNode& to, Port port, const Bytes& bytes) {
  if (Chance(fault_model_.drop)) return;
  Deliver(to, port, bytes);
  if (Chance(fault_model_.duplicate)) Deliver(to, port, bytes);
}

void SimulatedNetwork::Deliver(SimulatedNode& to, Port port, const Bytes& bytes) {
  if (to.inbox.size() >= fault_model_.receive_buffer) {
    ++to.counters.kernel_drops;
    return;
  }
  const auto spread = std::max<std::int64_t>(0, (fault_model_.max_delay - fault_model_.min_delay).count());
  microseconds delay = fault_model_.min_delay;
  if (spread > 0) delay += microseconds(Below(static_cast<std::uint64_t>(spread) + 1));
  if (Chance(fault_model_.reorder)) {
    delay += microseconds(Below(static_cast<std::uint64_t>(fault_model_.reorder_delay.count()) + 1));
  }
  to.inbox.emplace(now_ + delay, std::make_pair(port, CorruptDatagram(bytes)));
}

SimulatedNetwork::Bytes SimulatedNetwork::CorruptDatagram(const Bytes& bytes) {
  const bool corrupt = Chance(fault_model_.corrupt);
  const bool truncate = Chance(fault_model_.truncate);
  if ((!corrupt && !truncate) || bytes->empty()) return bytes;
  std::vector<std::uint8_t> injured = *bytes;
  if (corrupt) {
    constexpr std::uint64_t kMaxChanges = 3;
    constexpr std::uint64_t kOtherValues = 255;
    for (std::uint64_t n = 1 + Below(kMaxChanges); n > 0; --n) {
      auto& byte = injured[Below(injured.size())];
      byte = static_cast<std::uint8_t>(byte ^ (1 + Below(kOtherValues)));
    }
  }
  if (truncate) injured.resize(Below(injured.size()));
  return std::make_shared<const std::vector<std::uint8_t>>(std::move(injured));
}

bool SimulatedNetwork::Run(std::span<Endpoint* const> endpoints, const std::function<bool()>& done,
                           microseconds limit) {
  const microseconds end = now_ + limit;
  while (true) {
    for (Endpoint* endpoint : endpoints) endpoint->Poll(microseconds(0));
    if (done()) return true;
    if (now_ >= end) return false;
    std::optional<microseconds> next = next_delivery();
    for (const Endpoint* endpoint : endpoints) {
      const auto timer = endpoint->next_timer();
      if (timer && (!next || *timer < *next)) next = timer;
    }
    // Without a next event, jumps to the end; only `done` can change its result then.
    AdvanceTo(std::min(end, next.value_or(end)));
  }
}

SimulatedTransport::SimulatedTransport(SimulatedNetwork& network, std::int64_t deployment,
                                       std::shared_ptr<const MessageKey> key)
    : network_(&network), deployment_(deployment), key_(std::move(key)) {
  network.simulated_nodes_.push_back(std::make_unique<SimulatedNetwork::SimulatedNode>());
  simulated_node_ = network.simulated_nodes_.back().get();
}

SimulatedTransport::~SimulatedTransport() {
  std::erase_if(network_->simulated_node_of_, [this](const auto& entry) { return entry.second == simulated_node_; });
  std::erase_if(network_->simulated_nodes_,
                [this](const auto& simulated_node) { return simulated_node.get() == simulated_node_; });
}

void SimulatedTransport::Send(Port port, std::span<const std::uint8_t> datagram) {
  if (datagram.size() > kMaxDatagramBytes) {
    std::fprintf(stderr, "legopt bus: broken invariant: datagram of %zu bytes, limit %zu\n", datagram.size(),
                 kMaxDatagramBytes);
    std::abort();
  }
  ++simulated_node_->counters.datagrams_sent;
  simulated_node_->counters.bytes_sent += datagram.size();
  network_->Send(simulated_node_, port, datagram);
}

void SimulatedTransport::SetReceiver(DatagramReceiver* receiver, EndpointId self) {
  simulated_node_->receiver = receiver;
  std::erase_if(network_->simulated_node_of_, [this](const auto& entry) { return entry.second == simulated_node_; });
  if (receiver != nullptr) network_->simulated_node_of_[self] = simulated_node_;
}

int SimulatedTransport::Poll(std::span<pollfd> extra, microseconds /*max_wait*/) {
  if (!extra.empty()) ::poll(extra.data(), extra.size(), 0);
  std::size_t delivered = 0;
  auto& inbox = simulated_node_->inbox;
  while (!inbox.empty() && inbox.begin()->first <= network_->now() && delivered < most_per_poll_) {
    const auto [port, bytes] = std::move(inbox.begin()->second);
    inbox.erase(inbox.begin());
    if (simulated_node_->receiver == nullptr) continue;
    ++delivered;
    ++simulated_node_->counters.datagrams_received;
    simulated_node_->counters.bytes_received += bytes->size();
    simulated_node_->receiver->OnDatagram(port, *bytes);
  }
  return static_cast<int>(delivered);
}

microseconds SimulatedTransport::now() const { return network_->now(); }
std::int64_t SimulatedTransport::deployment() const { return deployment_; }
std::optional<microseconds> SimulatedTransport::next_arrival() const {
  if (simulated_node_->inbox.empty()) return std::nullopt;
  return simulated_node_->inbox.begin()->first;
}
TransportCounters SimulatedTransport::counters() const { return simulated_node_->counters; }

}  // namespace legopt::bus
