// Common interface to both networks, so that the conformance suite runs on each: parties, waiting, recording,
// injecting.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bus/endpoint.h"
#include "bus/message_key.h"
#include "bus/transport.h"

namespace legopt::bus {

inline constexpr const char* kGroup = "239.255.76.67";

using Datagram = std::vector<std::uint8_t>;

class TestBed {
 public:
  virtual ~TestBed() = default;

  // Adds a party with its own transport, which lives until Remove or the end of the bed.
  virtual Endpoint& Add(EndpointId id, const EndpointOptions& options = {}, std::int64_t deployment = kDeployment) = 0;
  virtual void Remove(Endpoint& endpoint) = 0;
  // Polls all parties until `done`; returns false if `limit` of the bed's time passes first.
  virtual bool RunUntil(const std::function<bool()>& done, microseconds limit = std::chrono::seconds(30)) = 0;
  // Injects a datagram from outside.
  virtual void Inject(Port port, std::span<const std::uint8_t> datagram) = 0;
  // Returns everything sent since the bed was made, including injected datagrams.
  virtual const std::vector<std::pair<Port, Datagram>>& recorded() = 0;

  static constexpr std::int64_t kDeployment = 4711;
};

enum class BedKind { kSimulated, kSimulatedWithKey, kUdp, kBridged };

// Returns a key for tests, which is not secret.
std::shared_ptr<const MessageKey> TestKey(std::uint8_t first_byte = 0);

// Returns null and sets `why` if real multicast is not available.
std::unique_ptr<TestBed> MakeTestBed(BedKind kind, std::string* why);

// Moves the calling thread into a new network namespace; with `route`, loopback is up and carries multicast. Returns
// an empty string, or the reason of a refusal.
std::string EnterPrivateNetwork(bool route);

}  // namespace legopt::bus
