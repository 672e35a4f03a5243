#include "tests/bus/test_bed.h"

#include <arpa/inet.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <list>
#include <stdexcept>

#include "bus/bridge/bridge.h"
#include "bus/lcm_transport.h"
#include "tests/doubles/simulated_network.h"

namespace legopt::bus {
namespace {

using std::chrono::milliseconds;

template <class TransportType>
struct BedParty {
  std::unique_ptr<TransportType> transport;
  std::unique_ptr<Endpoint> endpoint;
};

class SimulatedBed final : public TestBed {
 public:
  explicit SimulatedBed(std::shared_ptr<const MessageKey> key) : network_(1), key_(std::move(key)) {
    network_.SetTap([this](Port port, std::span<const std::uint8_t> bytes) {
      recorded_.emplace_back(port, Datagram(bytes.begin(), bytes.end()));
    });
  }

  Endpoint& Add(EndpointId id, const EndpointOptions& options, std::int64_t deployment) override {
    BedParty<SimulatedTransport> party;
    party.transport = std::make_unique<SimulatedTransport>(network_, deployment, key_);
    party.endpoint = std::make_unique<Endpoint>(*party.transport, id, ++seed_, options);
    parties_.push_back(std::move(party));
    return *parties_.back().endpoint;
  }

  void Remove(Endpoint& endpoint) override {
    std::erase_if(parties_, [&](const auto& party) { return party.endpoint.get() == &endpoint; });
  }

  bool RunUntil(const std::function<bool()>& done, microseconds limit) override {
    std::vector<Endpoint*> endpoints;
    for (const auto& party : parties_) endpoints.push_back(party.endpoint.get());
    return network_.Run(endpoints, done, limit);
  }

  void Inject(Port port, std::span<const std::uint8_t> datagram) override { network_.Inject(port, datagram); }
  const std::vector<std::pair<Port, Datagram>>& recorded() override { return recorded_; }

 private:
  SimulatedNetwork network_;
  std::shared_ptr<const MessageKey> key_;
  std::vector<std::pair<Port, Datagram>> recorded_;
  std::list<BedParty<SimulatedTransport>> parties_;  // not a vector: moving would separate endpoint and transport
  std::uint64_t seed_ = 0;
};

const sockaddr* Generic(const sockaddr_in& address) { return reinterpret_cast<const sockaddr*>(&address); }

// A plain UDP listener and sender on the port that LCM uses.
class Wire {
 public:
  explicit Wire(int port) : fd_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    const int on = 1;
    const int buffer = 8 << 20;
    const unsigned char ttl = 0;
    address_.sin_family = AF_INET;
    address_.sin_port = htons(static_cast<std::uint16_t>(port));
    ::inet_pton(AF_INET, kGroup, &address_.sin_addr);
    ip_mreqn membership{};  // on loopback, like parties with TTL 0
    membership.imr_multiaddr = address_.sin_addr;
    membership.imr_ifindex = static_cast<int>(::if_nametoindex("lo"));
    ::setsockopt(fd_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
    ::setsockopt(fd_, SOL_SOCKET, SO_RCVBUFFORCE, &buffer, sizeof(buffer));
    ::setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &buffer, sizeof(buffer));
    ::setsockopt(fd_, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof(ttl));
    ::setsockopt(fd_, IPPROTO_IP, IP_MULTICAST_IF, &membership, sizeof(membership));
    if (::bind(fd_, Generic(address_), sizeof(address_)) != 0 ||
        ::setsockopt(fd_, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof(membership)) != 0) {
      throw std::runtime_error("test wire: cannot join");
    }
  }
  ~Wire() { ::close(fd_); }
  Wire(const Wire&) = delete;
  Wire& operator=(const Wire&) = delete;

  void Send(std::span<const std::uint8_t> bytes) {
    ::sendto(fd_, bytes.data(), bytes.size(), 0, Generic(address_), sizeof(address_));
  }
  // Calls `sink` with each waiting packet.
  template <class Sink>
  void Drain(Sink sink) {
    std::array<std::uint8_t, 65536> buffer{};
    for (ssize_t size = 0; (size = ::recv(fd_, buffer.data(), buffer.size(), 0)) >= 0;) {
      sink(std::span<const std::uint8_t>(buffer.data(), static_cast<std::size_t>(size)));
    }
  }

 private:
  int fd_;
  sockaddr_in address_{};
};

class UdpBed : public TestBed {
 public:
  UdpBed() : port_(FindFreePortPair(RandomSeed())), control_(port_), bulk_(port_ + 1) {}

  Endpoint& Add(EndpointId id, const EndpointOptions& options, std::int64_t deployment) override {
    LcmOptions lcm = BusOf(id);
    lcm.deployment = deployment;
    BedParty<LcmTransport> party;
    party.transport = std::make_unique<LcmTransport>(lcm);
    party.endpoint = std::make_unique<Endpoint>(*party.transport, id, RandomSeed(), options);
    parties_.push_back(std::move(party));
    return *parties_.back().endpoint;
  }

  void Remove(Endpoint& endpoint) override {
    std::erase_if(parties_, [&](const auto& party) { return party.endpoint.get() == &endpoint; });
  }

  bool RunUntil(const std::function<bool()>& done, microseconds limit) override {
    const auto end = std::chrono::steady_clock::now() + limit;
    while (!done()) {
      if (std::chrono::steady_clock::now() >= end) return false;
      // One thread serves all: the first party waits a little, so that an idle bed does not spin.
      microseconds wait = milliseconds(1);
      for (const auto& party : parties_) {
        party.endpoint->Poll(wait);
        wait = microseconds(0);
      }
      Record();
    }
    return true;
  }

  void Inject(Port port, std::span<const std::uint8_t> datagram) override {
    Datagram packet = {'L', 'C', '0', '2', 0, 0, 0, 0, 'L', 'E', 'G', 'O', 'P', 'T', 0};
    packet.insert(packet.end(), datagram.begin(), datagram.end());
    (port == Port::kControl ? control_ : bulk_).Send(packet);
  }

  const std::vector<std::pair<Port, Datagram>>& recorded() override {
    Record();
    return recorded_;
  }

 protected:
  // Returns the bus of the party with this address.
  virtual LcmOptions BusOf(EndpointId /*id*/) const {
    LcmOptions lcm;
    lcm.group = kGroup;
    lcm.port = port_;
    return lcm;
  }

 private:
  void Record() {
    for (const Port port : {Port::kControl, Port::kBulk}) {
      (port == Port::kControl ? control_ : bulk_).Drain([&](std::span<const std::uint8_t> packet) {
        constexpr std::size_t kLcmBytes = 15;
        // LCM's self-tests arrive here as well.
        if (packet.size() < kLcmBytes || packet[8] != 'L' || packet[9] != 'E') return;
        recorded_.emplace_back(port, Datagram(packet.begin() + kLcmBytes, packet.end()));
      });
    }
  }

  int port_;
  Wire control_;
  Wire bulk_;
  std::vector<std::pair<Port, Datagram>> recorded_;
  std::list<BedParty<LcmTransport>> parties_;  // not a vector: moving would separate endpoint and transport
};

// The server is on one bus, which is recorded; all others are on another bus, joined by a bridge.
class BridgedBed final : public UdpBed {
 public:
  BridgedBed() : far_port_(FindFreePortPair(RandomSeed())) {
    const bridge::LinkAddress any = bridge::ParseLinkAddress("127.0.0.1:1") & ~bridge::LinkAddress{0xFFFF};
    bridge::LinkSocket socket(any);
    const bridge::LinkAddress address = socket.address();
    hub_ = bridge::Bridge::RunHub(Bridged(kServer), std::move(socket));
    spoke_ = bridge::Bridge::RunSpoke(Bridged(kServer + 1), bridge::LinkSocket(any), {address});
    // Tests count retries, so the link must be up before the first datagram.
    BridgedBed::RunUntil([this] { return spoke_->linked(); }, std::chrono::seconds(10));
  }

 protected:
  LcmOptions BusOf(EndpointId id) const override {
    LcmOptions lcm = UdpBed::BusOf(id);
    if (id != kServer) lcm.port = far_port_;
    return lcm;
  }

 private:
  LcmOptions Bridged(EndpointId id) const {
    LcmOptions lcm = BusOf(id);
    lcm.deployment = kDeployment;
    return lcm;
  }

  int far_port_;
  std::unique_ptr<bridge::Bridge> hub_, spoke_;
};

}  // namespace

std::shared_ptr<const MessageKey> TestKey(std::uint8_t first_byte) {
  std::array<std::uint8_t, MessageKey::kBytes> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(first_byte + i);
  return std::make_shared<const MessageKey>(std::span<const std::uint8_t, MessageKey::kBytes>(bytes));
}

std::string EnterPrivateNetwork(bool route) {
  if (::unshare(CLONE_NEWNET) != 0) return std::string("unshare(CLONE_NEWNET): ") + std::strerror(errno);
  constexpr char kRoute[] = "ip link set lo up && ip route add 239.255.76.67/32 dev lo";
  return !route || std::system(kRoute) == 0 ? "" : std::string("'") + kRoute + "'";
}

std::unique_ptr<TestBed> MakeTestBed(BedKind kind, std::string* why) {
  if (kind == BedKind::kSimulated) return std::make_unique<SimulatedBed>(nullptr);
  if (kind == BedKind::kSimulatedWithKey) return std::make_unique<SimulatedBed>(TestKey());
  const MulticastRoute route = ProbeMulticastRoute(kGroup);
  if (const std::string refused = route.usable ? "" : EnterPrivateNetwork(true); !refused.empty()) {
    *why = "NOT TESTED over real multicast: " + route.problem + "; refused: " + refused;
    return nullptr;
  }
  if (kind == BedKind::kBridged) return std::make_unique<BridgedBed>();
  return std::make_unique<UdpBed>();
}

}  // namespace legopt::bus
