#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/serve/http_connections.h"

/// A small web server for pages: GET and HEAD, a stream of events, and limits that visitors cannot exceed.
namespace legopt::client {

/// A browser's request.
struct HttpRequest {
  std::string path;        ///< path as sent, starting with "/", without the query
  std::string experiment;  ///< value of the query parameter "experiment"; empty: none
};

/// An answer. Bodies are shared, so slow readers need no copies.
struct HttpReply {
  unsigned status = 200;
  std::string type = "text/plain; charset=utf-8";
  std::shared_ptr<const std::string> body;  ///< not null
  std::string etag;                         ///< empty: not cacheable
};

/// Returns an answer with a line of text.
HttpReply TextReply(unsigned status, const std::string& text);

/// Listening address and limits.
struct HttpOptions {
  std::string address = "127.0.0.1";   ///< numeric IPv4 or IPv6 address
  std::uint16_t port = 0;              ///< 0: any free port
  std::vector<std::string> hosts;      ///< allowed host names besides the address and localhost
  std::string streams_at = "/events";  ///< path of the event stream
  HttpLimits limits;
  unsigned idle_s = 30;                   ///< time after which a reader that receives nothing of its answer is
                                          ///< disconnected
  std::size_t connection_bytes = 32'768;  ///< memory per connection; longer request heads are refused
};

/// Serves HTTP/1.1 in a separate thread, with two more threads for slow answers. Accepts only GET and HEAD; refuses
/// requests with a body, or for a foreign host name (DNS rebinding). Headers of every answer forbid framing, content
/// sniffing and foreign scripts. The connection limits are lowered to the limit of open files. Thread rule: one thread
/// creates and destroys the server; Publish and the counters may be used from any thread.
class HttpServer {
 public:
  /// Answers immediately in the network thread; must not block. nullopt: the slow handler is called.
  using Quick = std::function<std::optional<HttpReply>(const HttpRequest&)>;
  /// Answers in one of two threads; an exception becomes an answer with status 500.
  using Slow = std::function<HttpReply(const HttpRequest&)>;

  /// Throws ClientError: kNetworkUnusable if listening on the address fails, kMachine with the remedy if the limit of
  /// open files is too low.
  HttpServer(HttpOptions options, Quick quick, Slow slow);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// URL with the actual port: "http://127.0.0.1:8080/".
  const std::string& url() const;
  /// Sends an event to all streams; a slow stream gets only the newest event. `data` is one line; `id` must not
  /// decrease.
  void Publish(std::uint64_t id, const std::string& data);
  /// Sends a comment to all streams, so that closed connections are detected.
  void Beat();
  unsigned streams() const;        ///< number of open streams
  std::uint64_t requests() const;  ///< number of requests since the start

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace legopt::client
