#include "bus/bridge/bridge.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstring>
#include <functional>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include "bus/bridge/hub_and_spoke.h"
#include "bus/bridge/link.h"
#include "bus/bus_error.h"
#include "bus/endpoint.h"

namespace legopt::bridge {
namespace {

using bus::BusError;
using bus::BusErrorCode;

constexpr unsigned kPortBits = 16;
constexpr std::uint32_t kLoopbackNet = 127;
constexpr int kLinkBufferBytes = 4 << 20;  // large because the traffic of a whole pool meets at the hub

LinkAddress Pack(std::uint32_t host, std::uint16_t port) { return (LinkAddress{host} << kPortBits) | port; }
std::uint32_t HostOf(LinkAddress address) { return static_cast<std::uint32_t>(address >> kPortBits); }
std::uint16_t PortOf(LinkAddress address) { return static_cast<std::uint16_t>(address); }

sockaddr_in ToSocketAddress(LinkAddress address) {
  sockaddr_in raw{};
  raw.sin_family = AF_INET;
  raw.sin_port = htons(PortOf(address));
  raw.sin_addr.s_addr = htonl(HostOf(address));
  return raw;
}

LinkAddress FromSocketAddress(const sockaddr_in& raw) { return Pack(ntohl(raw.sin_addr.s_addr), ntohs(raw.sin_port)); }

// The FORCE options let root exceed net.core.rmem_max; other users keep the size from SO_RCVBUF.
void AskForBuffers(int fd) {
  for (const int option : {SO_RCVBUF, SO_SNDBUF, SO_RCVBUFFORCE, SO_SNDBUFFORCE}) {
    ::setsockopt(fd, SOL_SOCKET, option, &kLinkBufferBytes, sizeof kLinkBufferBytes);
  }
}

}  // namespace

LinkAddress ParseLinkAddress(std::string_view text) {
  const auto refuse = [&](const char* why) -> LinkAddress {
    throw BusError(BusErrorCode::kInvalidOption, "address '" + std::string(text) + "': " + why +
                                                     "; expected ADDRESS:PORT, as in 192.168.1.2:7669, or PORT");
  };
  const std::size_t colon = text.rfind(':');
  const std::string_view digits = colon == std::string_view::npos ? text : text.substr(colon + 1);
  std::uint16_t port = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), port);
  if (error != std::errc{} || end != digits.data() + digits.size() || port == 0) {
    return refuse("the port is no number from 1 to 65535");
  }
  if (colon == std::string_view::npos) return Pack(INADDR_ANY, port);
  in_addr host{};
  if (::inet_pton(AF_INET, std::string(text.substr(0, colon)).c_str(), &host) != 1) {
    return refuse("not an IPv4 address");
  }
  return Pack(ntohl(host.s_addr), port);
}

std::string ToString(LinkAddress address) {
  char host[INET_ADDRSTRLEN] = "";
  const sockaddr_in raw = ToSocketAddress(address);
  ::inet_ntop(AF_INET, &raw.sin_addr, host, sizeof host);
  return std::string(host) + ":" + std::to_string(PortOf(address));
}

bool IsLoopback(LinkAddress address) {
  constexpr unsigned kNetShift = 24;
  return HostOf(address) >> kNetShift == kLoopbackNet;
}

std::vector<LinkAddress> ReachableAddresses(LinkAddress bound) {
  if (HostOf(bound) != INADDR_ANY) return {bound};
  std::vector<LinkAddress> outside, loopback;
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return {};
  for (const ifaddrs* entry = list; entry != nullptr; entry = entry->ifa_next) {
    if (entry->ifa_addr == nullptr || entry->ifa_addr->sa_family != AF_INET || (entry->ifa_flags & IFF_UP) == 0) {
      continue;
    }
    sockaddr_in raw{};
    std::memcpy(&raw, entry->ifa_addr, sizeof raw);
    raw.sin_port = htons(PortOf(bound));
    const LinkAddress address = FromSocketAddress(raw);
    (IsLoopback(address) ? loopback : outside).push_back(address);
  }
  ::freeifaddrs(list);
  outside.insert(outside.end(), loopback.begin(), loopback.end());
  return outside;
}

LinkSocket::LinkSocket(LinkAddress address) : fd_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
  const sockaddr_in raw = ToSocketAddress(address);
  if (fd_ >= 0 && ::bind(fd_, reinterpret_cast<const sockaddr*>(&raw), sizeof raw) == 0) {
    AskForBuffers(fd_);
    return;
  }
  const int error = errno;
  if (fd_ >= 0) ::close(fd_);
  throw BusError(error == EADDRINUSE || error == EACCES ? BusErrorCode::kPortUnusable : BusErrorCode::kNetworkUnusable,
                 "UDP address " + ToString(address) + " cannot be taken: " + std::strerror(error));
}

LinkSocket::~LinkSocket() {
  if (fd_ >= 0) ::close(fd_);
}

LinkAddress LinkSocket::address() const {
  sockaddr_in raw{};
  socklen_t size = sizeof raw;
  ::getsockname(fd_, reinterpret_cast<sockaddr*>(&raw), &size);
  return FromSocketAddress(raw);
}

void LinkSocket::Send(LinkAddress to, std::span<const std::uint8_t> datagram) const {
  const sockaddr_in raw = ToSocketAddress(to);
  ::sendto(fd_, datagram.data(), datagram.size(), 0, reinterpret_cast<const sockaddr*>(&raw), sizeof raw);
}

std::size_t LinkSocket::Receive(std::span<std::uint8_t> room, LinkAddress& from) const {
  sockaddr_in raw{};
  socklen_t size = sizeof raw;
  const ssize_t bytes = ::recvfrom(fd_, room.data(), room.size(), 0, reinterpret_cast<sockaddr*>(&raw), &size);
  if (bytes <= 0) return 0;
  from = FromSocketAddress(raw);
  return static_cast<std::size_t>(bytes);
}

namespace {

constexpr int kMaxPerRound = 256;  // maximum number of link datagrams per round, so that the bus is not starved
constexpr microseconds kLongestRound = std::chrono::seconds(1);

// Starts a thread that blocks all signals, so that the program's own thread handles them.
std::thread StartWithoutSignals(std::function<void()> work) {
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  std::thread thread(std::move(work));
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return thread;
}

}  // namespace

// Thread with the sockets. The link end decides what to do with datagrams.
class Bridge::Loop final : private Carrier, private bus::DatagramReceiver {
 public:
  using MakeEnd = std::function<std::unique_ptr<LinkEnd>(const DeploymentIdentity&, Carrier&)>;

  Loop(const bus::LcmOptions& bus, LinkSocket socket, const MakeEnd& make_end)
      : bus_(bus), socket_(std::move(socket)), stop_fd_(::eventfd(0, EFD_CLOEXEC)) {
    if (stop_fd_ < 0) throw bus::BusError(bus::BusErrorCode::kNetworkUnusable, "no descriptor for a bridge's end");
    end_ = make_end(DeploymentIdentity{bus_.deployment(), bus_.key()}, *this);
    bus_.SetReceiver(this, 0);
    thread_ = StartWithoutSignals([this] { Run(); });
  }
  ~Loop() {
    const std::uint64_t one = 1;
    if (::write(stop_fd_, &one, sizeof one) != sizeof one) std::terminate();  // an eventfd accepts it
    thread_.join();
    ::close(stop_fd_);
    bus_.SetReceiver(nullptr, 0);
  }
  Loop(const Loop&) = delete;
  Loop& operator=(const Loop&) = delete;

  LinkCounters counters() const {
    const std::lock_guard lock(mutex_);
    return published_;
  }
  bool linked() const { return linked_; }

 private:
  void Run() {
    std::array<pollfd, 2> extra{pollfd{socket_.descriptor(), POLLIN, 0}, pollfd{stop_fd_, POLLIN, 0}};
    while ((extra[1].revents & POLLIN) == 0) {
      const microseconds now = bus_.now();
      bus_.Poll(extra, std::clamp(end_->next_deadline() - now, microseconds(0), kLongestRound));
      if ((extra[0].revents & POLLIN) != 0) DrainLink();
      end_->Tick(bus_.now());
      linked_ = end_->linked();
      const std::lock_guard lock(mutex_);
      published_ = end_->counters();
    }
  }

  void DrainLink() {
    // One byte larger than the largest envelope, to detect datagrams that are too large.
    std::array<std::uint8_t, kMaxEnvelopeBytes + 1> room{};
    for (int i = 0; i < kMaxPerRound; ++i) {
      LinkAddress from = 0;
      const std::size_t bytes = socket_.Receive(room, from);
      if (bytes == 0) return;
      end_->OnLink(from, std::span(room.data(), bytes), bus_.now());
    }
  }

  void OnDatagram(bus::Port port, std::span<const std::uint8_t> datagram) noexcept override {
    end_->OnBus(port, datagram, bus_.now());
  }
  void ToBus(bus::Port port, std::span<const std::uint8_t> frame) override { bus_.Send(port, frame); }
  void ToLink(LinkAddress to, std::span<const std::uint8_t> envelope) override { socket_.Send(to, envelope); }

  bus::LcmTransport bus_;
  LinkSocket socket_;
  int stop_fd_;
  std::unique_ptr<LinkEnd> end_;
  mutable std::mutex mutex_;
  LinkCounters published_;
  std::atomic<bool> linked_{false};
  std::thread thread_;
};

Bridge::Bridge(std::unique_ptr<Loop> loop) : loop_(std::move(loop)) {}
Bridge::~Bridge() = default;

LinkCounters Bridge::counters() const { return loop_->counters(); }
bool Bridge::linked() const { return loop_->linked(); }

std::unique_ptr<Bridge> Bridge::RunHub(const bus::LcmOptions& bus, LinkSocket socket) {
  const auto make = [](const DeploymentIdentity& membership, Carrier& carrier) -> std::unique_ptr<LinkEnd> {
    return std::make_unique<Hub>(membership, bus::RandomSeed(), carrier);
  };
  return std::unique_ptr<Bridge>(new Bridge(std::make_unique<Loop>(bus, std::move(socket), make)));
}

std::unique_ptr<Bridge> Bridge::RunSpoke(const bus::LcmOptions& bus, LinkSocket socket, std::vector<LinkAddress> hub) {
  const auto make = [&hub](const DeploymentIdentity& membership, Carrier& carrier) -> std::unique_ptr<LinkEnd> {
    return std::make_unique<Spoke>(membership, std::move(hub), bus::RandomSeed(), carrier);
  };
  return std::unique_ptr<Bridge>(new Bridge(std::make_unique<Loop>(bus, std::move(socket), make)));
}

}  // namespace legopt::bridge
