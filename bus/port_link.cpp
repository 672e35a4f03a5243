#include "bus/port_link.h"

#include <arpa/inet.h>
#include <dirent.h>
#include <fcntl.h>
#include <pthread.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <csignal>
#include <cstring>
#include <new>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include "bus/bus_error.h"
#include "bus/multicast.h"
#include "bus/udp_socket.h"

namespace legopt::bus {
namespace {

// Fallback without /proc. New descriptors get the lowest free numbers, so all open ones are below a new one, except for
// gaps.
std::set<int> DescriptorsByTrial() {
  constexpr int kGaps = 64;
  std::set<int> descriptors;
  const int lowest_free = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  if (lowest_free < 0) return descriptors;
  ::close(lowest_free);
  for (int fd = 0; fd < lowest_free + kGaps; ++fd) descriptors.insert(fd);
  return descriptors;
}

std::set<int> Descriptors() {
  DIR* folder = ::opendir("/proc/self/fd");
  if (folder == nullptr) return DescriptorsByTrial();
  std::set<int> descriptors;
  while (const dirent* entry = ::readdir(folder)) {
    int fd = 0;
    const char* end = entry->d_name + std::strlen(entry->d_name);
    if (std::from_chars(entry->d_name, end, fd).ptr == end) descriptors.insert(fd);
  }
  ::closedir(folder);
  return descriptors;
}

std::size_t ThreadStackBytes() {
  pthread_attr_t attributes;
  std::size_t bytes = 0;
  if (pthread_getattr_default_np(&attributes) != 0) return 0;
  pthread_attr_getstacksize(&attributes, &bytes);
  pthread_attr_destroy(&attributes);
  return bytes;
}

// GLib, which LCM uses, recurses until the stack ends if an allocation fails, also later in LCM's thread. Throws
// std::bad_alloc unless there is enough memory for LCM's buffers and thread, and for the threads that the program
// starts afterwards.
void RequireMemoryOfLcm() {
  constexpr std::size_t kBufferBytes = std::size_t{8} << 20, kThreads = 6;
  const std::size_t bytes = kThreads * ThreadStackBytes() + kBufferBytes;
  void* memory = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (memory == MAP_FAILED) throw std::bad_alloc();
  ::munmap(memory, bytes);
}

}  // namespace

std::map<int, FileIdentity> OpenSocketsAndPipes() {
  std::map<int, FileIdentity> files;
  for (const int fd : Descriptors()) {
    struct stat status {};
    if (::fstat(fd, &status) != 0 || (!S_ISSOCK(status.st_mode) && !S_ISFIFO(status.st_mode))) continue;
    files[fd] = {status.st_dev, status.st_ino};
  }
  return files;
}

OpenFilesBefore::OpenFilesBefore() {
  for (const auto& [fd, file] : OpenSocketsAndPipes()) files_.insert(file);
}

std::set<int> OpenFilesBefore::OpenedSince() const {
  std::set<int> descriptors;
  for (const auto& [fd, file] : OpenSocketsAndPipes()) {
    if (!files_.contains(file)) descriptors.insert(fd);
  }
  return descriptors;
}

namespace {

constexpr char kChannelName[] = "LEGOPT";
constexpr int kQueueCapacity = 16384;  // messages between LCM's reader thread and this one, at most 20 MB
constexpr std::chrono::milliseconds kProbePatience(400);  // per port; both ports together stay below a second
// Header that LCM writes before a datagram: magic, sequence number, channel and a zero byte.
constexpr std::string_view kShortFormMagic = "LC02";
constexpr std::size_t kShortFormBytes = kShortFormMagic.size() + sizeof(std::uint32_t) + sizeof kChannelName;
// Time after which no packet from before the filter was attached is left in a queue. Measured on the steady clock
// because the wall clock may jump.
constexpr std::chrono::seconds kSettling(2);

bool IsBoundTo(int fd, int port) {
  sockaddr_in address{};
  socklen_t length = sizeof(address);
  return ::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &length) == 0 && address.sin_family == AF_INET &&
         ntohs(address.sin_port) == port;
}

bool IsUdpSocket(int fd) {
  int domain = 0, type = 0;
  socklen_t length = sizeof domain;
  return ::getsockopt(fd, SOL_SOCKET, SO_DOMAIN, &domain, &length) == 0 && domain == AF_INET &&
         ::getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &length) == 0 && type == SOCK_DGRAM;
}

// Blocks all signals in the calling thread during its lifetime, so that LCM's threads, which inherit the mask, handle
// none.
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

// Keeps this host a member of the group on loopback during LCM's self-test of the group.
class LoopbackMembership {
 public:
  explicit LoopbackMembership(const in_addr& group) : fd_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    if (fd_ >= 0) JoinGroup(fd_, group, LoopbackIndex());
  }
  ~LoopbackMembership() {
    if (fd_ >= 0) ::close(fd_);
  }
  LoopbackMembership(const LoopbackMembership&) = delete;
  LoopbackMembership& operator=(const LoopbackMembership&) = delete;

 private:
  int fd_;
};

sockaddr_in AddressOf(const in_addr& host, int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr = host;
  return address;
}

std::int64_t WallClock_us() {
  return std::chrono::duration_cast<microseconds>(std::chrono::system_clock::now().time_since_epoch()).count();
}

// Limits the size, because LCM prints an error to stderr if the kernel grants less; receive_buffer_warning() reports
// that.
std::size_t BufferToAskFor(std::size_t wanted) {
  const std::uint64_t largest = 2 * LargestReceiveBuffer();
  return largest == 0 ? wanted : std::min<std::size_t>(wanted, largest);
}

}  // namespace

PortLink::PortLink(const LcmOptions& options, int udp_port, Sink sink)
    : options_(options), udp_port_(udp_port), sink_(std::move(sink)) {
  ::inet_pton(AF_INET, options_.group.c_str(), &group_);
  const ProbeResult probe = ProbeMulticast(options_.group, udp_port_, kProbePatience, options_.ttl);
  if (!probe.usable) throw BusError(probe.code, probe.problem);
  if (sends_locally() && !HasRoute(group_)) {
    OpenLoopbackSocket();
  } else {
    OpenLcm();
  }
}

PortLink::~PortLink() {
  if (lcm_ != nullptr) lcm_destroy(lcm_);  // joins the reader thread and frees the subscription
  if (own_fd_ >= 0) ::close(own_fd_);
}

void PortLink::OpenLcm() {
  const std::string url = "udpm://" + options_.group + ":" + std::to_string(udp_port_) +
                          "?ttl=" + std::to_string(options_.ttl) +
                          "&recv_buf_size=" + std::to_string(BufferToAskFor(options_.receive_buffer_bytes));
  const auto require = [&](bool done, const char* step) {
    if (done) return;
    if (lcm_ != nullptr) lcm_destroy(std::exchange(lcm_, nullptr));
    std::thread([] {}).join();  // throws std::system_error if no thread can be started, which LCM does not report
    throw BusError(BusErrorCode::kNetworkUnusable,
                   std::string("LCM cannot ") + step + " " + url + "; see the lines before this one");
  };
  const LoopbackMembership membership(group_);
  const OpenFilesBefore before;
  const SignalsBlocked guard;
  RequireMemoryOfLcm();
  lcm_ = lcm_create(url.c_str());
  require(lcm_ != nullptr, "open");
  if (sends_locally()) BindSendersToLoopback(before);
  lcm_subscription_t* subscription = lcm_subscribe(lcm_, kChannelName, &PortLink::OnMessage, this);
  require(subscription != nullptr, "subscribe on");
  lcm_subscription_set_queue_capacity(subscription, kQueueCapacity);
  wait_fd_ = lcm_get_fileno(lcm_);
  require(wait_fd_ >= 0, "wait on");
  Inspect(before);
  if (sends_locally()) {
    MoveMembershipToLoopback();
  } else {
    joined_ = RouteOf(group_);
  }
}

// Called before LCM opens its receiving socket: the only UDP socket opened so far is the sending one.
void PortLink::BindSendersToLoopback(const OpenFilesBefore& before) {
  bool bound = false;
  for (const int fd : before.OpenedSince()) {
    if (!IsUdpSocket(fd)) continue;
    LeaveGroup(fd, group_, 0);  // LCM also joins the group with the sending socket
    bound = SendThrough(fd, LoopbackIndex()) || bound;
  }
  if (bound) return;
  lcm_destroy(std::exchange(lcm_, nullptr));
  throw BusError(BusErrorCode::kNetworkUnusable,
                 "the socket with which LCM sends cannot be bound to loopback, so packets could leave this machine: "
                 "use a machine with /proc, or --ttl 1 and a key");
}

// Finds LCM's receiving socket, which LCM does not expose.
void PortLink::Inspect(const OpenFilesBefore& before) {
  for (const int fd : before.OpenedSince()) {
    ::fcntl(fd, F_SETFD, FD_CLOEXEC);  // job processes must not inherit the socket
    if (IsBoundTo(fd, udp_port_)) TakeReceiver(fd);
  }
}

void PortLink::TakeReceiver(int fd) {
  receive_fd_ = fd;
  struct stat status {};
  if (::fstat(fd, &status) == 0) inode_ = status.st_ino;
  const int wanted = static_cast<int>(options_.receive_buffer_bytes);
  // Exceeds net.core.rmem_max if the process is privileged; otherwise the kernel refuses, which is harmless.
  ::setsockopt(fd, SOL_SOCKET, SO_RCVBUFFORCE, &wanted, sizeof(wanted));
}

void PortLink::MoveMembershipToLoopback() {
  if (receive_fd_ < 0) return;
  if (hears_locally()) LeaveGroup(receive_fd_, group_, 0);
  if (!JoinGroup(receive_fd_, group_, LoopbackIndex())) {
    throw BusError(BusErrorCode::kNetworkUnusable,
                   "multicast " + options_.group + ": join group on loopback: " + std::strerror(errno));
  }
}

void PortLink::OpenLoopbackSocket() {
  own_fd_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const int on = 1, buffer = static_cast<int>(options_.receive_buffer_bytes);
  const unsigned char ttl = 0;
  ::setsockopt(own_fd_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  ::setsockopt(own_fd_, SOL_SOCKET, SO_RCVBUF, &buffer, sizeof buffer);
  ::setsockopt(own_fd_, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl);
  TakeReceiver(own_fd_);
  AttachFilter(0, 0);  // before any packet can arrive
  const sockaddr_in address = AddressOf({}, udp_port_);
  if (!SendThrough(own_fd_, LoopbackIndex()) || !JoinGroup(own_fd_, group_, LoopbackIndex()) ||
      ::bind(own_fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    const std::string reason = std::strerror(errno);
    ::close(std::exchange(own_fd_, -1));
    throw BusError(BusErrorCode::kNetworkUnusable, "UDP port " + std::to_string(udp_port_) + " on loopback: " + reason);
  }
  wait_fd_ = own_fd_;
}

bool PortLink::Send(std::span<const std::uint8_t> datagram) {
  if (lcm_ != nullptr) {
    return lcm_publish(lcm_, kChannelName, datagram.data(), static_cast<unsigned>(datagram.size())) == 0;
  }
  std::array<std::uint8_t, kShortFormBytes> front{'L', 'C', '0', '2'};
  const std::uint32_t sequence = htonl(sequence_++);
  std::memcpy(front.data() + kShortFormMagic.size(), &sequence, sizeof sequence);
  std::memcpy(front.data() + kShortFormBytes - sizeof kChannelName, kChannelName, sizeof kChannelName);
  std::array<iovec, 2> parts{iovec{front.data(), front.size()},
                             iovec{const_cast<std::uint8_t*>(datagram.data()), datagram.size()}};
  sockaddr_in to = AddressOf(group_, udp_port_);
  msghdr message{};
  message.msg_name = &to;
  message.msg_namelen = sizeof to;
  message.msg_iov = parts.data();
  message.msg_iovlen = parts.size();
  return ::sendmsg(own_fd_, &message, 0) >= 0;
}

void PortLink::Handle() {
  if (lcm_ != nullptr) {
    lcm_handle(lcm_);
  } else {
    HandleLoopbackSocket();
  }
}

void PortLink::HandleLoopbackSocket() {
  std::array<std::uint8_t, kShortFormBytes + kMaxDatagramBytes + 1> packet{};
  const ssize_t size = ::recv(own_fd_, packet.data(), packet.size(), 0);
  if (size < static_cast<ssize_t>(kShortFormBytes)) return;
  const std::string_view front(reinterpret_cast<const char*>(packet.data()), kShortFormBytes);
  const std::string_view channel(kChannelName, sizeof kChannelName);
  if (!front.starts_with(kShortFormMagic) || !front.ends_with(channel)) return;
  sink_({packet.data() + kShortFormBytes, static_cast<std::size_t>(size) - kShortFormBytes});
}

void PortLink::OnMessage(const lcm_recv_buf_t* message, const char* /*channel*/, void* link) {
  const auto* self = static_cast<const PortLink*>(link);
  // Packets received before the filter was attached may come from any host.
  const bool early =
      message->recv_utime < self->filtered_since_us_ && std::chrono::steady_clock::now() < self->settled_at_;
  if (early && self->hears_locally()) return;
  self->sink_({static_cast<const std::uint8_t*>(message->data), message->data_size});
}

bool PortLink::AttachFilter(std::int64_t deployment, std::int64_t self) {
  const int only_from = hears_locally() ? LoopbackIndex() : 0;
  const bool attached = receive_fd_ >= 0 && AttachSocketFilter(receive_fd_, deployment, self, only_from);
  if (attached && filtered_since_us_ == 0) {
    filtered_since_us_ = WallClock_us();
    settled_at_ = std::chrono::steady_clock::now() + kSettling;
  }
  return attached;
}

void PortLink::FollowRoute() {
  const int interface = RouteOf(group_);
  if (interface == 0 || receive_fd_ < 0) return;  // wait until there is a route again
  // Done even if the interface is the same, because the kernel drops memberships when an interface is removed and
  // re-added.
  LeaveGroup(receive_fd_, group_, joined_);
  if (JoinGroup(receive_fd_, group_, interface)) joined_ = interface;
}

std::size_t PortLink::granted_buffer() const {
  int granted = 0;
  socklen_t length = sizeof(granted);
  if (receive_fd_ < 0 || ::getsockopt(receive_fd_, SOL_SOCKET, SO_RCVBUF, &granted, &length) != 0) return 0;
  return static_cast<std::size_t>(granted);
}

}  // namespace legopt::bus
