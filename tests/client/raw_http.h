// A client that sends what it is told to, well-formed or not, over one TCP connection to this machine.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "programs/processes.h"

namespace legopt::test {

class RawHttp {
 public:
  /// Connects to 127.0.0.1, from 127.0.0.`visitor` (1 to 254). Throws std::system_error.
  explicit RawHttp(std::uint16_t port, int visitor = 1);

  /// False once the other side has closed, or takes nothing more for a second.
  bool Send(const std::string& bytes);
  /// GET with the Host of the server, and more header lines, each with its end.
  bool Get(const std::string& path, const std::string& headers = "");
  /// What comes until `until` is in it, the other side closes, or `limit` has passed; everything since the last call.
  std::string Receive(const std::string& until, std::chrono::milliseconds limit = std::chrono::seconds(20));
  /// Whether the other side closes within the limit; what comes before is dropped.
  bool Closed(std::chrono::milliseconds limit = std::chrono::seconds(20));

 private:
  programs::Descriptor socket_;
  std::uint16_t port_;
};

/// One GET on a connection of its own; head and body, until the other side closes.
std::string Fetch(std::uint16_t port, const std::string& path, const std::string& headers = "", int visitor = 1);

/// A TCP port of this machine that nobody uses at the moment.
std::uint16_t FreePort();

/// The port of "http://127.0.0.1:8080/".
std::uint16_t PortOf(const std::string& url);

}  // namespace legopt::test
