#pragma once

#include <sys/socket.h>

#include <chrono>
#include <cstdint>
#include <list>
#include <map>
#include <mutex>
#include <string>

namespace legopt::client {

/// How many connections a web server accepts, and how long one may take to send a request.
struct HttpLimits {
  unsigned most_connections = 448;        ///< more are answered with 503
  unsigned most_of_address = 64;          ///< connections of one address; more are answered with 503
  unsigned most_streams = 400;            ///< event streams; more are answered with 503
  unsigned most_streams_of_address = 32;  ///< event streams of one address; more are answered with 503
  std::chrono::milliseconds head{5000};   ///< time to send a request, from the connection's start or the last answer
};

/// The open connections of a web server: who holds how many, and which of them have sent no request in time. Where a
/// limit is reached, the oldest connection that waits for a request is closed for the newest one, so that connections
/// without requests do not block others. An IPv4 address, and the first 64 bits of an IPv6 address, count as one
/// visitor. Thread rule: any thread.
class HttpConnections {
 public:
  using Clock = std::chrono::steady_clock;

  /// One open connection.
  struct Entry {
    int socket = -1;
    std::string address;
    bool waiting = true;  ///< a request is awaited
    bool closed = false;  ///< shut down here; the library has not removed it yet
    Clock::time_point since{};
  };

  explicit HttpConnections(const HttpLimits& limits) : limits_(limits) {}

  /// How many connections the server's library must be able to hold: some more than may be answered, for the 503.
  unsigned capacity() const { return limits_.most_connections + kSpare; }

  /// Whether a new connection is accepted at all. False only while so many are being refused that none can be held.
  bool Admits(const sockaddr* from);

  /// A new connection. The entry is valid until Remove.
  Entry* Add(int socket, const sockaddr* from);
  void Remove(Entry* entry);

  /// The request of a connection has arrived. False: answer 503 and close, a limit is exceeded.
  bool BeginAnswer(Entry* entry);
  /// The answer is complete, or the connection is about to be closed.
  void EndAnswer(Entry* entry);

  /// Counts an event stream. False: the limit is reached, nothing is counted.
  bool OpenStream(const std::string& address);
  void CloseStream(const std::string& address);
  unsigned streams() const;

  /// Closes the connections that have sent no whole request in time.
  void CloseLate(Clock::time_point now);

 private:
  using Entries = std::list<Entry>;
  static constexpr unsigned kSpare = 32;
  unsigned CountOf(const std::string& address) const;
  void Close(Entry* entry);
  void CloseOldestWaiting(const std::string* address);  // null: whatever its address

  const HttpLimits limits_;
  mutable std::mutex mutex_;
  Entries entries_;  // oldest first
  std::map<std::string, unsigned> connections_of_, streams_of_;
  std::size_t closed_ = 0;  // entries that are
  unsigned streams_ = 0;
};

}  // namespace legopt::client
