#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "bus/bridge/link_end.h"
#include "bus/bridge/link_socket.h"
#include "bus/lcm_transport.h"

namespace legopt::bridge {

/// Running end of a link: a thread that forwards datagrams between LCM on this host and a UDP socket, until this object
/// is destroyed. Its transport receives the datagrams for all parties on the bus.
class Bridge {
 public:
  /// Runs the server's end. Throws bus::BusError.
  static std::unique_ptr<Bridge> RunHub(const bus::LcmOptions& bus, LinkSocket socket);
  /// Runs the end on another host; `hub` are all addresses of the server's end. Throws bus::BusError.
  static std::unique_ptr<Bridge> RunSpoke(const bus::LcmOptions& bus, LinkSocket socket, std::vector<LinkAddress> hub);
  ~Bridge();
  Bridge(const Bridge&) = delete;
  Bridge& operator=(const Bridge&) = delete;

  /// Recent counters. Callable from any thread.
  LinkCounters counters() const;
  /// Whether the other end answered recently; always true for a hub. Callable from any thread.
  bool linked() const;

 private:
  class Loop;
  explicit Bridge(std::unique_ptr<Loop> loop);

  std::unique_ptr<Loop> loop_;
};

}  // namespace legopt::bridge
