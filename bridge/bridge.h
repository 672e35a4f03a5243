#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "bridge/link_socket.h"
#include "bridge/passage.h"
#include "bus/lcm_transport.h"

namespace legopt::bridge {

/// One end of a link at work: a thread between LCM on this host and a UDP socket. It ends with this object. The
/// transport that it makes for itself hears what every party of the bus hears.
class Bridge {
 public:
  /// The server's end. Throws bus::BusError.
  static std::unique_ptr<Bridge> RunHub(const bus::LcmOptions& bus, LinkSocket socket);
  /// The end of another host; `hub` are all addresses of the server's end. Throws bus::BusError.
  static std::unique_ptr<Bridge> RunSpoke(const bus::LcmOptions& bus, LinkSocket socket, std::vector<LinkAddress> hub);
  ~Bridge();
  Bridge(const Bridge&) = delete;
  Bridge& operator=(const Bridge&) = delete;

  /// As of a moment ago. Any thread.
  PassageCounters counters() const;
  /// Whether the other end answers, as of a moment ago; a hub has none to wait for. Any thread.
  bool linked() const;

 private:
  class Loop;
  explicit Bridge(std::unique_ptr<Loop> loop);

  std::unique_ptr<Loop> loop_;
};

}  // namespace legopt::bridge
