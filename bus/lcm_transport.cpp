#include "bus/lcm_transport.h"

#include <dirent.h>
#include <fcntl.h>
#include <lcm/lcm.h>
#include <netinet/in.h>
#include <pthread.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <set>
#include <vector>

#include "bus/bus_error.h"
#include "bus/message_key.h"
#include "bus/multicast_probe.h"
#include "bus/socket_filter.h"
#include "bus/udp_statistics.h"

namespace legopt::bus {
namespace {

constexpr const char* kChannelName = "LEGOPT";
constexpr int kQueueCapacity = 16384;                     // messages between LCM's reader thread and us, at most 20 MB
constexpr int kMostPerPoll = 256;                         // datagrams delivered per Poll, so that timers get their turn
constexpr std::chrono::milliseconds kProbePatience(400);  // per port; both together stay within a second
constexpr microseconds kStatisticsInterval = std::chrono::milliseconds(200);

std::set<int> OpenDescriptors() {
  std::set<int> descriptors;
  DIR* folder = ::opendir("/proc/self/fd");
  if (folder == nullptr) return descriptors;
  while (const dirent* entry = ::readdir(folder)) {
    const int fd = std::atoi(entry->d_name);
    if (entry->d_name[0] != '.' && fd != ::dirfd(folder)) descriptors.insert(fd);
  }
  ::closedir(folder);
  return descriptors;
}

bool IsBoundTo(int fd, int port) {
  sockaddr_in address{};
  socklen_t length = sizeof(address);
  return ::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &length) == 0 && address.sin_family == AF_INET &&
         ntohs(address.sin_port) == port;
}

// Blocks every signal of the calling thread for its life, so that LCM's threads, which inherit the mask, never take
// one.
class SignalsBlocked {
 public:
  SignalsBlocked() {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before_);
  }
  ~SignalsBlocked() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  SignalsBlocked(const SignalsBlocked&) = delete;
  SignalsBlocked& operator=(const SignalsBlocked&) = delete;

 private:
  sigset_t before_{};
};

// FNV-1a of "group:port", positive. PROTOCOL.md, section 4.
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
  // One LCM object: one port.
  struct Link {
    Port port{};
    lcm_t* lcm = nullptr;
    int wait_fd = -1;     // LCM's notification pipe
    int receive_fd = -1;  // its socket, found by looking; -1 when not found
    std::uint64_t inode = 0;
    Impl* owner = nullptr;

    void Open(const LcmOptions& wanted);
    void Inspect(const std::set<int>& before, int udp_port, std::size_t wanted_buffer);
    std::size_t granted_buffer() const;
    static void OnMessage(const lcm_recv_buf_t* message, const char* channel, void* link);
  };

  explicit Impl(const LcmOptions& requested) : options(requested) {}
  ~Impl() {
    for (Link& link : links) {
      if (link.lcm != nullptr) lcm_destroy(link.lcm);  // joins the reader thread and frees the subscription
    }
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  std::uint64_t Drops() const { return SocketDrops(std::array{links[0].inode, links[1].inode}); }
  void AttachFilters(EndpointId self);
  void RefreshStatistics();

  LcmOptions options;
  std::int64_t deployment = 0;
  std::shared_ptr<const MessageKey> key;
  std::array<Link, 2> links;
  DatagramReceiver* receiver = nullptr;
  bool filtered = false;
  int delivered = 0;  // within the current Poll
  TransportCounters counts;
  std::uint64_t buffer_errors_at_start = 0;
  microseconds statistics_read{-kStatisticsInterval};
  std::vector<pollfd> waiting;
};

void LcmTransport::Impl::Link::OnMessage(const lcm_recv_buf_t* message, const char* /*channel*/, void* link) {
  const auto* self = static_cast<const Link*>(link);
  Impl& owner = *self->owner;
  ++owner.delivered;
  ++owner.counts.datagrams_received;
  owner.counts.bytes_received += message->data_size;
  if (owner.receiver == nullptr) return;
  owner.receiver->OnDatagram(self->port, {static_cast<const std::uint8_t*>(message->data), message->data_size});
}

void LcmTransport::Impl::Link::Open(const LcmOptions& wanted) {
  const int udp_port = wanted.port + (port == Port::kBulk ? 1 : 0);
  const ProbeResult probe = ProbeMulticast(wanted.group, udp_port, kProbePatience);
  if (!probe.usable) throw BusError(probe.code, probe.problem);

  // Asking for more than the kernel gives makes LCM complain on stderr; the caller is told by receive_buffer_warning().
  const std::uint64_t largest = 2 * LargestReceiveBuffer();
  const std::size_t ask =
      largest == 0 ? wanted.receive_buffer_bytes : std::min<std::size_t>(wanted.receive_buffer_bytes, largest);
  const std::string url = "udpm://" + wanted.group + ":" + std::to_string(udp_port) +
                          "?ttl=" + std::to_string(wanted.ttl) + "&recv_buf_size=" + std::to_string(ask);
  const auto fail = [&](const char* step) {
    throw BusError(BusErrorCode::kNetworkUnusable,
                   std::string("LCM cannot ") + step + " " + url + "; its reason stands on the error output");
  };
  const std::set<int> before = OpenDescriptors();
  const SignalsBlocked guard;
  lcm = lcm_create(url.c_str());
  if (lcm == nullptr) fail("open");
  lcm_subscription_t* subscription = lcm_subscribe(lcm, kChannelName, &Link::OnMessage, this);
  if (subscription == nullptr) fail("subscribe on");
  lcm_subscription_set_queue_capacity(subscription, kQueueCapacity);
  wait_fd = lcm_get_fileno(lcm);
  if (wait_fd < 0) fail("wait on");
  Inspect(before, udp_port, wanted.receive_buffer_bytes);
}

// Finds what LCM has opened and keeps to itself.
void LcmTransport::Impl::Link::Inspect(const std::set<int>& before, int udp_port, std::size_t wanted_buffer) {
  for (const int fd : OpenDescriptors()) {
    if (before.contains(fd)) continue;
    ::fcntl(fd, F_SETFD, FD_CLOEXEC);  // job processes must not inherit the socket
    if (!IsBoundTo(fd, udp_port)) continue;
    receive_fd = fd;
    struct stat status {};
    if (::fstat(fd, &status) == 0) inode = status.st_ino;
    const int wanted = static_cast<int>(wanted_buffer);
    // Beyond net.core.rmem_max where we are privileged; refused otherwise, which is fine.
    ::setsockopt(fd, SOL_SOCKET, SO_RCVBUFFORCE, &wanted, sizeof(wanted));
  }
}

std::size_t LcmTransport::Impl::Link::granted_buffer() const {
  int granted = 0;
  socklen_t length = sizeof(granted);
  if (receive_fd < 0 || ::getsockopt(receive_fd, SOL_SOCKET, SO_RCVBUF, &granted, &length) != 0) return 0;
  return static_cast<std::size_t>(granted);
}

void LcmTransport::Impl::AttachFilters(EndpointId self) {
  filtered = true;
  for (const Link& link : links) {
    if (link.receive_fd < 0 || !AttachSocketFilter(link.receive_fd, deployment, self)) filtered = false;
  }
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
  // Descriptors are told apart by what is new; two transports must not be made at the same instant.
  static std::mutex one_at_a_time;
  const std::lock_guard lock(one_at_a_time);
  for (std::size_t i = 0; i < impl_->links.size(); ++i) {
    Impl::Link& link = impl_->links[i];
    link.port = i == 0 ? Port::kControl : Port::kBulk;
    link.owner = impl_.get();
    link.Open(options);
  }
  impl_->AttachFilters(0);
}

LcmTransport::~LcmTransport() = default;

void LcmTransport::Send(Port port, std::span<const std::uint8_t> datagram) {
  if (datagram.size() > kMaxDatagramBytes) {
    std::fprintf(stderr, "legopt bus: broken invariant: datagram of %zu bytes, limit %zu\n", datagram.size(),
                 kMaxDatagramBytes);
    std::abort();
  }
  const Impl::Link& link = impl_->links[static_cast<std::size_t>(port)];
  ++impl_->counts.datagrams_sent;
  impl_->counts.bytes_sent += datagram.size();
  if (lcm_publish(link.lcm, kChannelName, datagram.data(), static_cast<unsigned>(datagram.size())) != 0) {
    ++impl_->counts.send_failures;
  }
}

void LcmTransport::SetReceiver(DatagramReceiver* receiver, EndpointId self) {
  impl_->receiver = receiver;
  impl_->AttachFilters(receiver == nullptr ? 0 : self);
}

// Waits with our own poll(); lcm_handle is called only when LCM has announced a message, so it never blocks.
int LcmTransport::Poll(std::span<pollfd> extra, microseconds max_wait) {
  Impl& impl = *impl_;
  const std::size_t links = impl.links.size();
  impl.waiting.clear();
  for (const Impl::Link& link : impl.links) impl.waiting.push_back({link.wait_fd, POLLIN, 0});
  impl.waiting.insert(impl.waiting.end(), extra.begin(), extra.end());
  impl.delivered = 0;
  constexpr std::int64_t kMicro = 1'000'000;
  const std::int64_t wait_us = std::max<std::int64_t>(0, max_wait.count());
  timespec wait{wait_us / kMicro, (wait_us % kMicro) * 1000};
  int ready = ::ppoll(impl.waiting.data(), impl.waiting.size(), &wait, nullptr);
  for (std::size_t i = 0; i < extra.size(); ++i)
    extra[i].revents = ready > 0 ? impl.waiting[links + i].revents : short{0};
  // A message of another channel counts as handled but is not delivered, so the bound is on rounds.
  for (int round = 0; ready > 0 && round < kMostPerPoll; ++round) {
    bool any = false;
    for (std::size_t i = 0; i < links; ++i) {
      if ((impl.waiting[i].revents & POLLIN) == 0) continue;
      any = true;
      lcm_handle(impl.links[i].lcm);
    }
    if (!any) break;
    ready = ::poll(impl.waiting.data(), links, 0);
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
  return std::min(impl_->links[0].granted_buffer(), impl_->links[1].granted_buffer());
}

std::string LcmTransport::receive_buffer_warning() const {
  // The kernel doubles what it grants, to account for its own overhead.
  const std::size_t granted = granted_receive_buffer_bytes() / 2;
  const std::size_t asked = impl_->options.receive_buffer_bytes;
  if (granted >= asked) return {};
  return "receive buffer of " + std::to_string(granted) + " bytes granted, " + std::to_string(asked) +
         " asked: bursts may be lost and repeated. As root: sysctl -w net.core.rmem_max=" + std::to_string(asked);
}

const MessageKey* LcmTransport::key() const { return impl_->key.get(); }

std::string LcmTransport::missing_key_warning() const {
  if (impl_->key != nullptr) return {};
  const bool local = impl_->options.ttl == 0;
  return std::string("no key: every program ") + (local ? "of this machine" : "that reaches the multicast group") +
         " can command this deployment; 'legopt keygen FILE' makes a key for --key-file";
}

bool LcmTransport::socket_filter_attached() const { return impl_->filtered; }

}  // namespace legopt::bus
