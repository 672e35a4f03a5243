#include "bus/lcm_transport.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "bus/bus_error.h"
#include "bus/message_key.h"
#include "bus/multicast.h"
#include "bus/port_link.h"
#include "bus/udp_socket.h"

namespace legopt::bus {
namespace {

constexpr int kLowestPort = 1024;
constexpr int kHighestPort = 65534;  // the bulk port is one higher
constexpr int kMaxTtl = 255;

[[noreturn]] void Refuse(const std::string& fault) { throw BusError(BusErrorCode::kInvalidOption, fault); }

// Returns the number if `text` is entirely a number.
std::optional<std::int64_t> WholeNumber(std::string_view text) {
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return number;
}

}  // namespace

LcmOptions LcmOptions::FromEnvironment() {
  LcmOptions options;
  if (const char* group = std::getenv("LEGOPT_GROUP"); group != nullptr && *group != '\0') options.group = group;
  if (const char* text = std::getenv("LEGOPT_PORT"); text != nullptr && *text != '\0') {
    const auto port = WholeNumber(text);
    if (!port || *port < kLowestPort || *port > kHighestPort) {
      Refuse("LEGOPT_PORT: \"" + std::string(text) + "\": must be a number in 1024 .. 65534");
    }
    options.port = static_cast<int>(*port);
  }
  if (const char* file = std::getenv("LEGOPT_KEY_FILE"); file != nullptr) options.key_file = file;
  if (const char* text = std::getenv("LEGOPT_DEPLOYMENT"); text != nullptr && *text != '\0') {
    const auto deployment = WholeNumber(text);
    if (!deployment || *deployment < 1) {
      Refuse("LEGOPT_DEPLOYMENT: \"" + std::string(text) + "\": must be a positive number of 63 bits");
    }
    options.deployment = *deployment;
  }
  options.Validate();
  return options;
}

void LcmOptions::Validate() const {
  in_addr address{};
  if (::inet_pton(AF_INET, group.c_str(), &address) != 1 || !IN_MULTICAST(ntohl(address.s_addr))) {
    Refuse("group: \"" + group + "\": must be an IPv4 multicast address, 224.0.0.0 .. 239.255.255.255");
  }
  if (port < kLowestPort || port > kHighestPort) {
    Refuse("port: " + std::to_string(port) + ": must be in 1024 .. 65534 (the next one is used as well)");
  }
  if (ttl < 0 || ttl > kMaxTtl) Refuse("ttl: " + std::to_string(ttl) + ": must be in 0 .. 255");
  if (ttl > 0 && key_file.empty() && !trust_network) {
    Refuse("ttl: " + std::to_string(ttl) +
           ": messages would leave this host without a key; give one with --key-file ('legopt service keygen FILE' "
           "makes it), or "
           "--trust-network if everybody on that network may command this deployment");
  }
  constexpr std::size_t kLargestBuffer = std::size_t{1} << 30;
  if (receive_buffer_bytes > kLargestBuffer) {
    Refuse("receive_buffer_bytes: " + std::to_string(receive_buffer_bytes) + ": at most 1 GiB");
  }
  if (deployment < 0) Refuse("deployment: " + std::to_string(deployment) + ": must not be negative");
}

namespace {

constexpr int kMaxPerPoll = 256;  // maximum number of datagrams per Poll, so that timers are not starved
constexpr std::chrono::seconds kFollowInterval(1);  // minimum time between two rejoins
constexpr microseconds kStatisticsInterval = std::chrono::milliseconds(200);

// Throws if poll() failed; `ready` is its return value. Ignoring the failure would cause a busy loop.
void RequireWaited(int ready) {
  if (ready < 0 && errno != EINTR) {
    throw std::system_error(errno, std::generic_category(), "cannot wait for messages (poll)");
  }
}

// Returns the FNV-1a hash of "group:port" as a positive number. PROTOCOL.md, section 4.
std::int64_t DeriveDeployment(const LcmOptions& options) {
  constexpr std::uint64_t kOffset = 0xCBF29CE484222325ULL;
  constexpr std::uint64_t kPrime = 0x100000001B3ULL;
  std::uint64_t hash = kOffset;
  for (const char c : options.group + ":" + std::to_string(options.port)) {
    hash = (hash ^ static_cast<std::uint8_t>(c)) * kPrime;
  }
  return std::max<std::int64_t>(1, static_cast<std::int64_t>(hash & static_cast<std::uint64_t>(INT64_MAX)));
}

}  // namespace

struct LcmTransport::Impl {
  explicit Impl(const LcmOptions& requested) : options(requested) {}
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  std::uint64_t Drops() const { return SocketDrops(std::array{links[0]->inode(), links[1]->inode()}); }
  void Open(Port port);
  void Deliver(Port port, std::span<const std::uint8_t> datagram);
  void AttachFilters(EndpointId self);
  void RequireOnlyThisHost() const;
  bool WatchIsDue() const;
  void FollowRoutes();
  void RefreshStatistics();

  LcmOptions options;
  std::int64_t deployment = 0;
  std::shared_ptr<const MessageKey> key;
  std::array<std::unique_ptr<PortLink>, 2> links;
  std::optional<InterfaceWatch> watch;  // set only if TTL > 0
  std::chrono::steady_clock::time_point follow_again;
  DatagramReceiver* receiver = nullptr;
  bool filtered = false;
  int delivered = 0;  // number delivered in the current Poll
  TransportCounters counts;
  std::uint64_t buffer_errors_at_start = 0;
  microseconds statistics_read{-kStatisticsInterval};
  std::vector<pollfd> waiting;
};

void LcmTransport::Impl::Open(Port port) {
  const bool control = port == Port::kControl;
  links[control ? 0 : 1] =
      std::make_unique<PortLink>(options, options.port + (control ? 0 : 1),
                                 [this, port](std::span<const std::uint8_t> datagram) { Deliver(port, datagram); });
}

void LcmTransport::Impl::Deliver(Port port, std::span<const std::uint8_t> datagram) {
  ++delivered;
  ++counts.datagrams_received;
  counts.bytes_received += datagram.size();
  if (receiver != nullptr) receiver->OnDatagram(port, datagram);
}

void LcmTransport::Impl::AttachFilters(EndpointId self) {
  filtered = true;
  for (const auto& link : links) filtered = link->AttachFilter(deployment, self) && filtered;
}

// Requires a socket filter or a key for TTL 0. Otherwise every host that reaches the ports could send commands.
void LcmTransport::Impl::RequireOnlyThisHost() const {
  if (filtered || options.ttl > 0 || options.hear_all_hosts || key != nullptr) return;
  throw BusError(
      BusErrorCode::kNetworkUnusable,
      "the kernel attaches no socket filter here, so programs of other hosts could command this deployment; "
      "give it a key: legopt service keygen FILE, then --key-file FILE or LEGOPT_KEY_FILE for every program");
}

bool LcmTransport::Impl::WatchIsDue() const {
  return watch && watch->descriptor() >= 0 && std::chrono::steady_clock::now() >= follow_again;
}

void LcmTransport::Impl::FollowRoutes() {
  follow_again = std::chrono::steady_clock::now() + kFollowInterval;
  if (!watch->TakeChanges()) return;
  for (const auto& link : links) link->FollowRoute();
}

void LcmTransport::Impl::RefreshStatistics() {
  counts.kernel_drops = ReceiveBufferErrors() - buffer_errors_at_start;
  counts.kernel_filtered = Drops();
}

LcmTransport::LcmTransport(const LcmOptions& options) : impl_(std::make_unique<Impl>(options)) {
  options.Validate();
  impl_->deployment = options.deployment != 0 ? options.deployment : DeriveDeployment(options);
  impl_->key = options.key;
  if (impl_->key == nullptr && !options.key_file.empty()) impl_->key = MessageKey::Load(options.key_file);
  impl_->buffer_errors_at_start = ReceiveBufferErrors();
  if (options.ttl > 0) impl_->watch.emplace();
  // PortLink finds LCM's sockets as those that are new, so two transports must not be opened concurrently.
  static std::mutex one_at_a_time;
  const std::lock_guard lock(one_at_a_time);
  impl_->Open(Port::kControl);
  impl_->Open(Port::kBulk);
  impl_->AttachFilters(0);
  impl_->RequireOnlyThisHost();
}

LcmTransport::~LcmTransport() = default;

void LcmTransport::Send(Port port, std::span<const std::uint8_t> datagram) {
  if (datagram.size() > kMaxDatagramBytes) {
    std::fprintf(stderr, "legopt bus: broken invariant: datagram of %zu bytes, limit %zu\n", datagram.size(),
                 kMaxDatagramBytes);
    std::abort();
  }
  ++impl_->counts.datagrams_sent;
  impl_->counts.bytes_sent += datagram.size();
  if (!impl_->links[static_cast<std::size_t>(port)]->Send(datagram)) ++impl_->counts.send_failures;
}

void LcmTransport::SetReceiver(DatagramReceiver* receiver, EndpointId self) {
  impl_->receiver = receiver;
  impl_->AttachFilters(receiver == nullptr ? 0 : self);
}

// Waits with its own poll(). A link handles a packet only after its descriptor became readable, so nothing here blocks.
int LcmTransport::Poll(std::span<pollfd> extra, microseconds max_wait) {
  Impl& impl = *impl_;
  const std::size_t links = impl.links.size();
  impl.waiting.clear();
  for (const auto& link : impl.links) impl.waiting.push_back({link->wait_descriptor(), POLLIN, 0});
  impl.waiting.push_back({impl.WatchIsDue() ? impl.watch->descriptor() : -1, POLLIN, 0});
  impl.waiting.insert(impl.waiting.end(), extra.begin(), extra.end());
  impl.delivered = 0;
  constexpr std::int64_t kMicro = 1'000'000;
  const std::int64_t wait_us = std::max<std::int64_t>(0, max_wait.count());
  timespec wait{wait_us / kMicro, (wait_us % kMicro) * 1000};
  int ready = ::ppoll(impl.waiting.data(), impl.waiting.size(), &wait, nullptr);
  RequireWaited(ready);
  for (std::size_t i = 0; i < extra.size(); ++i)
    extra[i].revents = ready > 0 ? impl.waiting[links + 1 + i].revents : short{0};
  if (ready > 0 && impl.waiting[links].revents != 0) impl.FollowRoutes();
  // Limits the number of rounds, because a message of another channel is handled but not delivered.
  for (int round = 0; ready > 0 && round < kMaxPerPoll; ++round) {
    bool any = false;
    for (std::size_t i = 0; i < links; ++i) {
      if ((impl.waiting[i].revents & POLLIN) == 0) continue;
      any = true;
      impl.links[i]->Handle();
    }
    if (!any) break;
    ready = ::poll(impl.waiting.data(), links, 0);
    RequireWaited(ready);
  }
  return impl.delivered;
}

microseconds LcmTransport::now() const {
  return std::chrono::duration_cast<microseconds>(std::chrono::steady_clock::now().time_since_epoch());
}

std::int64_t LcmTransport::deployment() const { return impl_->deployment; }

TransportCounters LcmTransport::counters() const {
  if (now() - impl_->statistics_read >= kStatisticsInterval) {
    impl_->statistics_read = now();
    impl_->RefreshStatistics();
  }
  return impl_->counts;
}

std::size_t LcmTransport::granted_receive_buffer_bytes() const {
  return std::min(impl_->links[0]->granted_buffer(), impl_->links[1]->granted_buffer());
}

std::string LcmTransport::receive_buffer_warning() const {
  // The kernel doubles the granted size to account for its own overhead.
  const std::size_t granted = granted_receive_buffer_bytes() / 2;
  if (granted == 0) return {};  // unknown
  const std::size_t asked = impl_->options.receive_buffer_bytes;
  if (granted >= asked) return {};
  return "receive buffer of " + std::to_string(granted) + " bytes granted, " + std::to_string(asked) +
         " asked: bursts may be lost and repeated. As root: sysctl -w net.core.rmem_max=" + std::to_string(asked);
}

const MessageKey* LcmTransport::key() const { return impl_->key.get(); }

std::string LcmTransport::missing_key_warning() const {
  if (impl_->key != nullptr) return {};
  const bool local = impl_->options.ttl == 0;
  return std::string("no key: every program ") + (local ? "on this machine" : "that reaches the multicast group") +
         " can command this deployment; 'legopt service keygen FILE' makes a key for --key-file";
}

bool LcmTransport::socket_filter_attached() const { return impl_->filtered; }

}  // namespace legopt::bus
