#pragma once

#include <sys/socket.h>

#include <chrono>
#include <cstdint>
#include <list>
#include <map>
#include <mutex>
#include <string>

namespace legopt::client {

/// Limits on the connections of a web server.
struct HttpLimits {
  unsigned most_connections = 448;        ///< further ones are answered with 503
  unsigned most_of_address = 64;          ///< connections per address; further ones are answered with 503
  unsigned most_streams = 400;            ///< event streams; further ones are answered with 503
  unsigned most_streams_of_address = 32;  ///< event streams per address; further ones are answered with 503
  std::chrono::milliseconds head{5000};   ///< time for sending a request, from the start of the connection or the last
                                          ///< answer
};

/// The open connections of a web server: their number per visitor, and whether they sent a request in time. If a limit
/// is reached, a new connection replaces the oldest one that waits for a request, so that idle connections do not block
/// others. An IPv4 address, or the first 64 bits of an IPv6 address, identifies a visitor. Thread rule: any thread.
class HttpConnections {
 public:
  using Clock = std::chrono::steady_clock;

  /// An open connection.
  struct Entry {
    int socket = -1;
    std::string address;
    bool waiting = true;  ///< waiting for a request
    bool closed = false;  ///< shut down, but not yet removed by the HTTP library
    Clock::time_point since{};
  };

  explicit HttpConnections(const HttpLimits& limits) : limits_(limits) {}

  /// Capacity required of the HTTP library: more than the limit, so that 503 can be sent.
  unsigned capacity() const { return limits_.most_connections + kSpare; }

  /// Returns whether a new connection is accepted at all; false only while too many connections are being refused.
  bool Admits(const sockaddr* from);

  /// Adds a connection. The entry is valid until Remove.
  Entry* Add(int socket, const sockaddr* from);
  void Remove(Entry* entry);

  /// Marks that a request has arrived. Returns false if a limit is exceeded: answer 503 and close.
  bool BeginAnswer(Entry* entry);
  /// Marks that the answer is complete, or that the connection is about to be closed.
  void EndAnswer(Entry* entry);

  /// Counts an event stream. Returns false, without counting it, if the limit is reached.
  bool OpenStream(const std::string& address);
  void CloseStream(const std::string& address);
  unsigned streams() const;

  /// Closes the connections that have not sent a complete request in time.
  void CloseLate(Clock::time_point now);

 private:
  using Entries = std::list<Entry>;
  static constexpr unsigned kSpare = 32;
  unsigned CountOf(const std::string& address) const;
  void Close(Entry* entry);
  void CloseOldestWaiting(const std::string* address);  // nullptr: of any address

  const HttpLimits limits_;
  mutable std::mutex mutex_;
  Entries entries_;  // oldest first
  std::map<std::string, unsigned> connections_of_, streams_of_;
  std::size_t closed_ = 0;  // number of closed entries
  unsigned streams_ = 0;
};

}  // namespace legopt::client
