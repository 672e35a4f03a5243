// A client that sends arbitrary bytes, well-formed or not, over one TCP connection to this machine.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "app/processes.h"

namespace legopt::test {

class RawHttp {
 public:
  /// Connects to 127.0.0.1, from 127.0.0.`visitor` (1 to 254). Throws std::system_error.
  explicit RawHttp(std::uint16_t port, int visitor = 1);

  /// Sends bytes; returns false if the other side has closed or accepts no more for a second.
  bool Send(const std::string& bytes);
  /// Sends a GET with the server's Host and with further header lines, each with its line end.
  bool Get(const std::string& path, const std::string& headers = "");
  /// Receives until `until` occurs, the other side closes, or `limit` passes. Returns everything since the last call.
  std::string Receive(const std::string& until, std::chrono::milliseconds limit = std::chrono::seconds(20));
  /// Returns whether the other side closes within the limit; discards everything received before.
  bool Closed(std::chrono::milliseconds limit = std::chrono::seconds(20));

 private:
  app::Descriptor socket_;
  std::uint16_t port_;
};

/// Makes one GET on a separate connection; returns head and body until the other side closes.
std::string Fetch(std::uint16_t port, const std::string& path, const std::string& headers = "", int visitor = 1);

/// Returns a TCP port of this machine that is unused at the moment.
std::uint16_t FreePort();

/// Returns the port of a URL like "http://127.0.0.1:8080/".
std::uint16_t PortOf(const std::string& url);

}  // namespace legopt::test
