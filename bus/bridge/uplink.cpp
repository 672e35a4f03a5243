#include "bus/bridge/uplink.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <net/route.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>
#include <utility>

#include "bus/bridge/bridge.h"
#include "bus/bus_error.h"
#include "bus/endpoint.h"
#include "bus/lcm_transport.h"
#include "bus/message_key.h"
#include "bus/network_namespace.h"
#include "legopt/files/written_file.h"

namespace legopt::bridge {
namespace {

using bus::BusError;
using bus::BusErrorCode;

constexpr const char* kFirstLine = "legopt-access 1";
constexpr std::size_t kMaxAddresses = 64;
constexpr std::size_t kLongestLine = 200;
constexpr std::size_t kMostFileBytes = 2 * kMaxAddresses * kLongestLine;

[[noreturn]] void Refuse(const std::string& file, const std::string& why) {
  throw BusError(BusErrorCode::kInvalidOption, "access file " + file + ": " + why);
}

std::string TextOf(const Access& access) {
  std::string text = std::string(kFirstLine) + "\ndeployment " + std::to_string(access.deployment) + "\n";
  for (const LinkAddress address : access.addresses) text += "address " + ToString(address) + "\n";
  return text;
}

// Parses one line after the first into `access`. Returns its fault; empty if there is none.
std::string TakeLine(const std::string& line, Access& access) {
  const std::size_t space = line.find(' ');
  const std::string word = line.substr(0, space);
  const std::string value = space == std::string::npos ? "" : line.substr(space + 1);
  if (word == "deployment") {
    if (access.deployment != 0) return "a second deployment";
    const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), access.deployment);
    if (error != std::errc{} || end != value.data() + value.size() || access.deployment < 1) {
      return "'" + value + "' is no deployment number";
    }
    return "";
  }
  if (word != "address") return "unknown word '" + word + "'";
  if (access.addresses.size() == kMaxAddresses) return "more than " + std::to_string(kMaxAddresses) + " addresses";
  try {
    access.addresses.push_back(ParseLinkAddress(value));
  } catch (const BusError& error) {
    return error.what();
  }
  return "";
}

// Reads at most kMostFileBytes, so that an endless file costs no memory.
std::string ContentOf(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream && files::IsShortage(errno)) throw std::system_error(errno, std::generic_category(), file);
  if (!stream) Refuse(file, std::string("cannot be read: ") + std::strerror(errno));
  std::string text(kMostFileBytes + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (text.size() > kMostFileBytes) Refuse(file, "is larger than any access file; check that it is the right one");
  return text;
}

// Returns the first line without its line end and removes both from `text`.
std::string_view TakeFirstLine(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return line;
}

}  // namespace

std::string ListOf(const std::vector<LinkAddress>& addresses) {
  std::string list;
  for (const LinkAddress address : addresses) list += (list.empty() ? "" : ", ") + ToString(address);
  return list;
}

void WriteAccessFile(const std::string& file, const Access& access) {
  std::error_code ignored;
  if (std::filesystem::is_symlink(file, ignored) && !files::IsStream(file)) {
    Refuse(file, "is a symbolic link, which may lead to a file of another program; remove it or name another file");
  }
  try {
    files::ReplaceFile(file, TextOf(access), {files::kReadableByOwner, files::Durability::kSynced});
  } catch (const files::FileError& error) {
    if (error.shortage()) throw;
    Refuse(file, error.reason());
  }
}

Access ReadAccessFile(const std::string& file) {
  const std::string text = ContentOf(file);
  std::string_view rest = text;
  if (TakeFirstLine(rest) != kFirstLine) {
    Refuse(file, "not an access file of this release; 'legopt-server --listen' writes one");
  }
  Access access;
  for (int number = 2; !rest.empty(); ++number) {
    const std::string line(TakeFirstLine(rest));
    if (line.empty() || line[0] == '#') continue;
    const std::string fault = line.size() > kLongestLine ? "too long" : TakeLine(line, access);
    if (!fault.empty()) Refuse(file, "line " + std::to_string(number) + ": " + fault);
  }
  if (access.deployment == 0) Refuse(file, "names no deployment");
  if (access.addresses.empty()) Refuse(file, "names no address");
  return access;
}

namespace {

constexpr char kLoopbackName[] = "lo";

std::string Refused(const char* step) { return std::string(step) + ": " + std::strerror(errno); }

std::string RouteOverLoopback(const std::string& group) {
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return Refused("socket");
  rtentry route{};
  std::array<char, sizeof kLoopbackName> device{};
  std::memcpy(device.data(), kLoopbackName, sizeof kLoopbackName);
  sockaddr_in destination{};
  destination.sin_family = AF_INET;
  ::inet_pton(AF_INET, group.c_str(), &destination.sin_addr);
  std::memcpy(&route.rt_dst, &destination, sizeof destination);
  route.rt_flags = RTF_UP | RTF_HOST;
  route.rt_dev = device.data();
  const bool routed = ::ioctl(fd, SIOCADDRT, &route) == 0 || errno == EEXIST;
  const std::string refused = routed ? "" : Refused("route over loopback");
  ::close(fd);
  return refused;
}

std::string Enter(const std::string& group) {
  if (const std::string refused = bus::EnterNetworkNamespace(); !refused.empty()) return refused;
  if (const std::string refused = bus::RaiseLoopback(); !refused.empty()) return refused;
  if (const std::string refused = RouteOverLoopback(group); !refused.empty()) return refused;
  return bus::ProbeMulticastRoute(group).problem;
}

// Tests in a child process whether the namespace can be created, because a process cannot leave a namespace again.
std::string Try(const std::string& group) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return Refused("pipe");
  const pid_t scout = ::fork();
  if (scout < 0) return Refused("fork");
  if (scout == 0) {
    const std::string refused = Enter(group);
    const bool told = ::write(ends[1], refused.data(), refused.size()) == static_cast<ssize_t>(refused.size());
    ::_exit(told && refused.empty() ? 0 : 1);
  }
  ::close(ends[1]);
  std::array<char, 500> text{};
  const ssize_t bytes = ::read(ends[0], text.data(), text.size());
  ::close(ends[0]);
  int status = 0;
  while (::waitpid(scout, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return "";
  return bytes > 0 ? std::string(text.data(), static_cast<std::size_t>(bytes)) : "the attempt ended without a word";
}

}  // namespace

std::string EnterIsolatedNetwork(const std::string& group) {
  if (const std::string refused = Try(group); !refused.empty()) return refused;
  // Entering a user namespace may clear the signal that ends this process when its parent ends.
  int signal_of_the_parents_end = 0;
  ::prctl(PR_GET_PDEATHSIG, &signal_of_the_parents_end);
  const std::string refused = Enter(group);
  ::prctl(PR_SET_PDEATHSIG, signal_of_the_parents_end);
  return refused;
}

namespace {

constexpr LinkAddress kAnyAddressAndPort = 0;

// Called after everything outside the namespace has been read and opened.
void ChooseBus(ServerUplink& uplink, BusLocation place) {
  bus::LcmOptions& network = uplink.network;
  if (!network.key_file.empty()) network.key = bus::MessageKey::Load(network.key_file);
  std::string why_not;
  if (place == BusLocation::kOwnNamespace) {
    const std::string refused = EnterIsolatedNetwork(network.group);
    if (refused.empty()) {
      uplink.bus = "in a network namespace of its own";
      return;
    }
    why_not = ", as there is no network namespace to be had (" + refused + ")";
  }
  network.port = bus::FindFreePortPair(bus::RandomSeed());
  uplink.bus = "on ports " + std::to_string(network.port) + " and " + std::to_string(network.port + 1) +
               " of this machine" + why_not;
}

}  // namespace

ServerUplink PrepareUplink(const bus::LcmOptions& network, const std::optional<std::string>& access_file,
                           BusLocation place) {
  ServerUplink uplink;
  uplink.network = network;
  if (!access_file) {
    uplink.server_address = network.group + ":" + std::to_string(network.port);
    return uplink;
  }
  const Access access = ReadAccessFile(*access_file);
  uplink.hub = access.addresses;
  uplink.server_address = ListOf(access.addresses) + " (" + *access_file + ")";
  uplink.socket.emplace(kAnyAddressAndPort);
  uplink.network.deployment = access.deployment;
  uplink.network.ttl = 0;
  ChooseBus(uplink, place);
  return uplink;
}

std::unique_ptr<Bridge> RunSpoke(ServerUplink uplink) {
  if (!uplink.bridged()) return nullptr;
  return Bridge::RunSpoke(uplink.network, std::move(*uplink.socket), std::move(uplink.hub));
}

}  // namespace legopt::bridge
