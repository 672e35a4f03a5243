#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/serve/http_connections.h"

/// A small web server for readers of a page: GET and HEAD, a stream of events, and limits that no reader can break.
namespace legopt::client {

/// What a browser asks for.
struct HttpRequest {
  std::string path;        ///< as sent, "/" first, without the query
  std::string experiment;  ///< value of the query's "experiment"; empty: none
};

/// An answer. Bodies are shared, so that a slow reader costs no copy.
struct HttpReply {
  unsigned status = 200;
  std::string type = "text/plain; charset=utf-8";  ///< Content-Type
  std::shared_ptr<const std::string> body;         ///< not null
  std::string etag;                                ///< empty: not to be kept by the browser
};

/// An answer with a line of text.
HttpReply TextReply(unsigned status, const std::string& text);

/// Where to listen, and what readers may take.
struct HttpOptions {
  std::string address = "127.0.0.1";      ///< IPv4 or IPv6, numeric
  std::uint16_t port = 0;                 ///< 0: a free one
  std::vector<std::string> hosts;         ///< names beside the address and localhost under which it may be asked for
  std::string streams_at = "/events";     ///< path of the stream
  HttpLimits limits;                      ///< limits of connections and streams
  unsigned idle_s = 30;                   ///< a reader that takes nothing of its answer for so long is disconnected
  std::size_t connection_bytes = 32'768;  ///< memory of one: longer heads are refused
};

/// Serves HTTP/1.1 in a thread of its own, with two more for answers that take time. Only GET and HEAD; a request with
/// a body, or for a host that is not ours (a page of another site that resolves to this machine), is refused. Every
/// answer forbids other sites to frame or sniff it, and scripts that are not its own. The limits of connections are
/// lowered if the process may not open as many files. Thread rule: one thread makes and destroys it; Publish and the
/// counts may be called from any thread.
class HttpServer {
 public:
  /// Answers at once, in the network's thread: must not wait. Empty: the slow handler is to be asked.
  using Quick = std::function<std::optional<HttpReply>(const HttpRequest&)>;
  /// Answers in one of two threads; an exception becomes an answer with status 500.
  using Slow = std::function<HttpReply(const HttpRequest&)>;

  /// Throws ClientError: kNetworkUnusable where the address cannot be listened on, kMachine where the limit of open
  /// files leaves none for readers, with what to do.
  HttpServer(HttpOptions options, Quick quick, Slow slow);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// With the port that was chosen: "http://127.0.0.1:8080/".
  const std::string& url() const;
  /// Sends an event to all streams; one that is behind gets the newest only. `data`: one line. `id`: never falls.
  void Publish(std::uint64_t id, const std::string& data);
  /// Sends a comment, which tells dead readers from silent ones.
  void Beat();
  unsigned streams() const;        ///< open now
  std::uint64_t requests() const;  ///< since the start

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace legopt::client
