// One interface over both networks, so that the conformance suite runs on each: parties, waiting, recording, injecting.
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

  // A party with its own transport. Lives until Remove or the end of the bed.
  virtual Endpoint& Add(EndpointId id, const EndpointOptions& options = {}, std::int64_t deployment = kDeployment) = 0;
  virtual void Remove(Endpoint& endpoint) = 0;
  // Polls all parties until `done`, or until `limit` of the bed's time has passed (then false).
  virtual bool RunUntil(const std::function<bool()>& done, microseconds limit = std::chrono::seconds(30)) = 0;
  // Puts a datagram on the wire from outside.
  virtual void Inject(Port port, std::span<const std::uint8_t> datagram) = 0;
  // Everything sent since the bed was made, injections included.
  virtual const std::vector<std::pair<Port, Datagram>>& recorded() = 0;

  static constexpr std::int64_t kDeployment = 4711;
};

enum class BedKind { kSimulated, kSimulatedWithKey, kUdp, kBridged };

// A key that everybody may know.
std::shared_ptr<const MessageKey> TestKey(std::uint8_t first_byte = 0);

// Empty, with `why`, when real multicast cannot be had here.
std::unique_ptr<TestBed> MakeTestBed(BedKind kind, std::string* why);

// Moves the calling thread into a network namespace of its own; with `route`, loopback is up and carries multicast.
// Returns what was refused of that, empty when it is done.
std::string EnterPrivateNetwork(bool route);

}  // namespace legopt::bus
