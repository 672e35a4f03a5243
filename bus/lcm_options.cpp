#include <arpa/inet.h>
#include <netinet/in.h>

#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

#include "bus/bus_error.h"
#include "bus/lcm_transport.h"

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

}  // namespace legopt::bus
