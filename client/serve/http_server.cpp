#include "client/serve/http_server.h"

#include <arpa/inet.h>
#include <microhttpd.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <mutex>
#include <set>
#include <system_error>
#include <thread>
#include <utility>

#include "client/client_error.h"

namespace legopt::client {
namespace {

constexpr unsigned kSlowThreads = 2;
constexpr unsigned kRetryAfter_s = 5;
constexpr std::chrono::milliseconds kKeepingInterval{250};

// Allows only content from this server; the script contains the styles.
constexpr char kPolicy[] =
    "default-src 'none'; script-src 'self'; style-src 'unsafe-inline'; img-src 'self' data: blob:; worker-src blob:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

union Address {
  sockaddr any;
  sockaddr_in v4;
  sockaddr_in6 v6;
};

Address ParseAddress(const std::string& text, std::uint16_t port) {
  Address address{};
  if (inet_pton(AF_INET, text.c_str(), &address.v4.sin_addr) == 1) {
    address.v4.sin_family = AF_INET;
    address.v4.sin_port = htons(port);
  } else if (inet_pton(AF_INET6, text.c_str(), &address.v6.sin6_addr) == 1) {
    address.v6.sin6_family = AF_INET6;
    address.v6.sin6_port = htons(port);
  } else {
    throw ClientError(ExitCode::kUsage, "'" + text + "' is no IPv4 or IPv6 address; name one of this machine's");
  }
  return address;
}

std::string InUrl(const std::string& address) {
  return address.find(':') == std::string::npos ? address : "[" + address + "]";
}

// Returns the name of a Host header in lower case, without its port.
std::string NameOf(std::string host) {
  const auto colon = host.rfind(':');
  if (colon != std::string::npos && host.find(']', colon) == std::string::npos) host.resize(colon);
  std::ranges::transform(host, host.begin(), [](unsigned char c) { return std::tolower(c); });
  return host;
}

// An HTTP library response, released at the end of its scope: the library keeps queued responses alive.
class Response {
 public:
  explicit Response(MHD_Response* response) : response_(response) {
    if (response_ == nullptr) throw std::bad_alloc();
  }
  ~Response() { MHD_destroy_response(response_); }
  Response(const Response&) = delete;
  Response& operator=(const Response&) = delete;
  Response& Header(const char* name, const std::string& value) {
    MHD_add_response_header(response_, name, value.c_str());
    return *this;
  }
  MHD_Result Queue(MHD_Connection* connection, unsigned status) {
    Header("Content-Security-Policy", kPolicy);
    Header("X-Content-Type-Options", "nosniff");
    Header("Referrer-Policy", "no-referrer");
    Header("Cross-Origin-Resource-Policy", "same-origin");
    return MHD_queue_response(connection, status, response_);
  }

 private:
  MHD_Response* response_;
};

// Keeps a body alive while the library sends it.
using Body = std::shared_ptr<const std::string>;

ssize_t ReadBody(void* body, std::uint64_t position, char* to, std::size_t most) {
  const std::string& text = **static_cast<Body*>(body);
  const std::size_t count = std::min(most, text.size() - static_cast<std::size_t>(position));
  std::memcpy(to, text.data() + position, count);
  return static_cast<ssize_t>(count);
}

void FreeBody(void* body) { delete static_cast<Body*>(body); }

}  // namespace

HttpReply TextReply(unsigned status, const std::string& text) {
  HttpReply reply;
  reply.status = status;
  reply.body = std::make_shared<const std::string>(text + "\n");
  return reply;
}

namespace {

// Raises the limit of open files if possible, and lowers the connection limits to it.
HttpLimits WithinOpenFiles(HttpLimits limits) {
  constexpr rlim_t kWanted = 4096, kOwnFiles = 100, kFewest = 16;
  rlimit files{};
  if (getrlimit(RLIMIT_NOFILE, &files) != 0) return limits;
  if (files.rlim_cur < kWanted) {
    files.rlim_cur = std::min(files.rlim_max, kWanted);
    setrlimit(RLIMIT_NOFILE, &files);
    getrlimit(RLIMIT_NOFILE, &files);
  }
  if (files.rlim_cur < kOwnFiles + kFewest) {
    throw ClientError(ExitCode::kMachine, "the limit of open files, " + std::to_string(files.rlim_cur) +
                                              ", leaves none for readers; raise it (ulimit -n 1024)");
  }
  limits.most_connections =
      static_cast<unsigned>(std::min<rlim_t>(limits.most_connections, files.rlim_cur - kOwnFiles));
  limits.most_streams = std::min(limits.most_streams, limits.most_connections);
  return limits;
}

}  // namespace

class HttpServer::Impl {
 public:
  Impl(HttpOptions options, Quick quick, Slow slow)
      : options_(std::move(options)),
        quick_(std::move(quick)),
        slow_(std::move(slow)),
        connections_(WithinOpenFiles(options_.limits)) {
    const Address address = ParseAddress(options_.address, options_.port);
    hosts_ = {"localhost", "127.0.0.1", "[::1]", InUrl(options_.address)};
    for (const std::string& host : options_.hosts) hosts_.insert(NameOf(host));
    constexpr unsigned kFlags =
        MHD_USE_INTERNAL_POLLING_THREAD | MHD_USE_EPOLL | MHD_ALLOW_SUSPEND_RESUME | MHD_USE_ITC;
    const unsigned v6 = address.any.sa_family == AF_INET6 ? MHD_USE_IPv6 : 0;
    daemon_ = MHD_start_daemon(kFlags | v6, options_.port, &Impl::OnAccept, this, &Impl::OnRequest, this,
                               MHD_OPTION_SOCK_ADDR, &address.any, MHD_OPTION_CONNECTION_LIMIT, connections_.capacity(),
                               MHD_OPTION_CONNECTION_TIMEOUT, options_.idle_s, MHD_OPTION_CONNECTION_MEMORY_LIMIT,
                               options_.connection_bytes, MHD_OPTION_NOTIFY_COMPLETED, &Impl::OnEnd, this,
                               MHD_OPTION_NOTIFY_CONNECTION, &Impl::OnConnection, this, MHD_OPTION_END);
    if (daemon_ == nullptr) {
      if (errno == EAGAIN || errno == ENOMEM) {  // a thread or its stack
        throw ClientError(ExitCode::kMachine,
                          "the page cannot be served: not enough memory or threads; raise ulimit -v and ulimit -u");
      }
      const std::string reason = std::generic_category().message(errno);
      throw ClientError(ExitCode::kNetworkUnusable,
                        "http://" + InUrl(options_.address) + ":" + std::to_string(options_.port) +
                            "/ cannot be served: " + reason + "; choose another with --http-port (0: a free one)");
    }
    const auto* const bound = MHD_get_daemon_info(daemon_, MHD_DAEMON_INFO_BIND_PORT);
    const std::uint16_t port = bound != nullptr ? bound->port : options_.port;
    url_ = "http://" + InUrl(options_.address) + ":" + std::to_string(port) + "/";
    for (unsigned i = 0; i < kSlowThreads; ++i) threads_.emplace_back([this] { AnswerSlowly(); });
    threads_.emplace_back([this] { CloseDeadConnections(); });
  }

  ~Impl() {
    {
      const std::lock_guard lock(mutex_);
      ending_ = true;
      WakeStreams();
    }
    wake_.notify_all();
    for (std::thread& thread : threads_) thread.join();
    {
      // The library must not be stopped while a connection is suspended.
      const std::lock_guard lock(mutex_);
      for (Exchange* exchange : waiting_) {
        exchange->reply = TextReply(MHD_HTTP_SERVICE_UNAVAILABLE, "the server ends");
        MHD_resume_connection(exchange->connection);
      }
      waiting_.clear();
      WakeStreams();
    }
    MHD_stop_daemon(daemon_);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  const std::string& url() const { return url_; }
  unsigned streams() const { return connections_.streams(); }
  std::uint64_t requests() const { return requests_; }

  void Publish(std::uint64_t id, const std::string& data) {
    const std::lock_guard lock(mutex_);
    event_ = std::make_shared<const std::string>("id: " + std::to_string(id) + "\ndata: " + data + "\n\n");
    ++event_number_;
    WakeStreams();
  }

  void Beat() {
    const std::lock_guard lock(mutex_);
    ++beat_number_;
    WakeStreams();
  }

 private:
  // A request and its answer; passed to the library as `con_cls`.
  struct Exchange {
    MHD_Connection* connection = nullptr;
    HttpRequest request;
    bool asked = false;  // a handler has been called
    std::optional<HttpReply> reply;
  };

  // An event stream. Owned by the library's response.
  struct Stream {
    Impl* impl = nullptr;
    MHD_Connection* connection = nullptr;
    std::uint64_t event_number = 0, beat_number = 0;  // last ones sent
    Body pending;
    std::size_t offset = 0;  // position in `pending`
    std::string address;     // the visitor's address, as counted by HttpConnections
    int socket = -1;
    bool gone = false;  // the reader has closed the connection
  };

  static MHD_Result OnAccept(void* self, const sockaddr* from, socklen_t) {
    return static_cast<Impl*>(self)->connections_.Admits(from) ? MHD_YES : MHD_NO;
  }

  static void OnConnection(void* self, MHD_Connection* connection, void** entry, MHD_ConnectionNotificationCode code) {
    HttpConnections& connections = static_cast<Impl*>(self)->connections_;
    if (code == MHD_CONNECTION_NOTIFY_CLOSED) {
      if (*entry != nullptr) connections.Remove(static_cast<HttpConnections::Entry*>(*entry));
      *entry = nullptr;
      return;
    }
    const auto* const socket = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD);
    const auto* const from = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CLIENT_ADDRESS);
    *entry = connections.Add(socket->connect_fd, from->client_addr);
  }

  static HttpConnections::Entry* EntryOf(MHD_Connection* connection) {
    const auto* const info = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
    return static_cast<HttpConnections::Entry*>(info->socket_context);
  }

  static MHD_Result OnRequest(void* self, MHD_Connection* connection, const char* path, const char* method, const char*,
                              const char*, std::size_t* body_bytes, void** state) {
    return static_cast<Impl*>(self)->Handle(connection, path, method, *body_bytes, state);
  }

  static void OnEnd(void* self, MHD_Connection* connection, void** state, MHD_RequestTerminationCode) {
    if (auto* entry = EntryOf(connection)) static_cast<Impl*>(self)->connections_.EndAnswer(entry);
    delete static_cast<Exchange*>(*state);
    *state = nullptr;
  }

  MHD_Result Handle(MHD_Connection* connection, const char* path, const std::string& method, std::size_t body_bytes,
                    void** state) {
    auto* exchange = static_cast<Exchange*>(*state);
    if (exchange == nullptr) {
      exchange = new Exchange{connection, {path, Argument(connection, "experiment")}, false, {}};
      *state = exchange;
      ++requests_;
      if (const auto refusal = Refusal(connection, method)) return Send(connection, *refusal);
      return MHD_YES;  // called again after the body, which must be empty
    }
    if (body_bytes != 0) return MHD_NO;  // closes the connection without reading more
    if (!exchange->asked && !connections_.BeginAnswer(EntryOf(connection))) {
      return Refuse(connection, "too many connections; try again later\n");
    }
    if (exchange->request.path == options_.streams_at) return OpenStream(connection, method == MHD_HTTP_METHOD_HEAD);
    if (!exchange->asked) {
      exchange->asked = true;
      exchange->reply = Guarded(quick_, exchange->request);
      if (!exchange->reply && Postpone(exchange)) return MHD_YES;
    }
    return Send(connection, *exchange->reply);
  }

  template <typename Handler>
  static std::optional<HttpReply> Guarded(const Handler& handler, const HttpRequest& request) {
    try {
      return handler(request);
    } catch (const std::exception& error) {
      return TextReply(MHD_HTTP_INTERNAL_SERVER_ERROR, error.what());
    }
  }

  // Queues the exchange for the slow threads; returns false if they are stopping.
  bool Postpone(Exchange* exchange) {
    const std::lock_guard lock(mutex_);
    if (ending_) {
      exchange->reply = TextReply(MHD_HTTP_SERVICE_UNAVAILABLE, "the server ends");
      return false;
    }
    waiting_.push_back(exchange);
    MHD_suspend_connection(exchange->connection);
    wake_.notify_all();
    return true;
  }

  static std::string Argument(MHD_Connection* connection, const char* name) {
    const char* const value = MHD_lookup_connection_value(connection, MHD_GET_ARGUMENT_KIND, name);
    return value == nullptr ? "" : value;
  }

  std::optional<HttpReply> Refusal(MHD_Connection* connection, const std::string& method) const {
    if (method != MHD_HTTP_METHOD_GET && method != MHD_HTTP_METHOD_HEAD) {
      return TextReply(MHD_HTTP_METHOD_NOT_ALLOWED, "only GET and HEAD");
    }
    const char* const host = MHD_lookup_connection_value(connection, MHD_HEADER_KIND, MHD_HTTP_HEADER_HOST);
    if (host == nullptr || !hosts_.contains(NameOf(host))) {
      return TextReply(MHD_HTTP_MISDIRECTED_REQUEST,
                       "this host name is not served: ask by the address, or name it with --http-host");
    }
    return std::nullopt;
  }

  static MHD_Result Send(MHD_Connection* connection, const HttpReply& reply) {
    const char* const known = MHD_lookup_connection_value(connection, MHD_HEADER_KIND, MHD_HTTP_HEADER_IF_NONE_MATCH);
    const bool same = known != nullptr && !reply.etag.empty() && known == "\"" + reply.etag + "\"";
    const Body body = same ? std::make_shared<const std::string>() : reply.body;
    constexpr std::size_t kPiece = 65'536;
    Response response(MHD_create_response_from_callback(body->size(), kPiece, &ReadBody, new Body(body), &FreeBody));
    response.Header(MHD_HTTP_HEADER_CONTENT_TYPE, reply.type)
        .Header(MHD_HTTP_HEADER_CACHE_CONTROL, reply.etag.empty() ? "no-store" : "no-cache");
    if (!reply.etag.empty()) response.Header(MHD_HTTP_HEADER_ETAG, "\"" + reply.etag + "\"");
    if (reply.status == MHD_HTTP_METHOD_NOT_ALLOWED) response.Header(MHD_HTTP_HEADER_ALLOW, "GET, HEAD");
    return response.Queue(connection, same ? MHD_HTTP_NOT_MODIFIED : reply.status);
  }

  // Answers 503 and closes the connection, so that it is no longer counted.
  static MHD_Result Refuse(MHD_Connection* connection, const std::string& reason) {
    Body text = std::make_shared<const std::string>(reason);
    Response response(
        MHD_create_response_from_callback(text->size(), text->size(), &ReadBody, new Body(text), &FreeBody));
    response.Header("Retry-After", std::to_string(kRetryAfter_s)).Header(MHD_HTTP_HEADER_CONNECTION, "close");
    return response.Queue(connection, MHD_HTTP_SERVICE_UNAVAILABLE);
  }

  MHD_Result OpenStream(MHD_Connection* connection, bool head_only) {
    const HttpConnections::Entry* const entry = EntryOf(connection);
    if (!connections_.OpenStream(entry->address)) return Refuse(connection, "too many streams; poll /state\n");
    auto* stream = new Stream{this, connection, 0, 0, nullptr, 0, entry->address, entry->socket, false};
    {
      const std::lock_guard lock(mutex_);
      stream->beat_number = beat_number_;
    }
    constexpr std::size_t kPiece = 16'384;
    Response response(MHD_create_response_from_callback(head_only ? 0 : MHD_SIZE_UNKNOWN, kPiece, &Impl::ReadStream,
                                                        stream, &Impl::FreeStream));
    response.Header(MHD_HTTP_HEADER_CONTENT_TYPE, "text/event-stream")
        .Header(MHD_HTTP_HEADER_CACHE_CONTROL, "no-store");
    return response.Queue(connection, MHD_HTTP_OK);
  }

  static ssize_t ReadStream(void* state, std::uint64_t, char* to, std::size_t most) {
    auto* stream = static_cast<Stream*>(state);
    return stream->impl->Fill(stream, to, most);
  }

  ssize_t Fill(Stream* stream, char* to, std::size_t most) {
    const std::lock_guard lock(mutex_);
    if (ending_) return MHD_CONTENT_READER_END_OF_STREAM;
    if (stream->gone) return MHD_CONTENT_READER_END_WITH_ERROR;
    if (!stream->pending) NextOf(stream);
    if (!stream->pending) {
      suspended_.insert(stream);
      MHD_suspend_connection(stream->connection);
      return 0;
    }
    const std::size_t count = std::min(most, stream->pending->size() - stream->offset);
    std::memcpy(to, stream->pending->data() + stream->offset, count);
    stream->offset += count;
    if (stream->offset == stream->pending->size()) stream->pending.reset();
    return static_cast<ssize_t>(count);
  }

  void NextOf(Stream* stream) const {
    if (event_ && stream->event_number < event_number_) {
      stream->event_number = event_number_;
      stream->pending = event_;
    } else if (stream->beat_number < beat_number_) {
      static const Body kComment = std::make_shared<const std::string>(": \n\n");
      stream->pending = kComment;
    }
    stream->beat_number = beat_number_;
    stream->offset = 0;
  }

  static void FreeStream(void* state) {
    auto* stream = static_cast<Stream*>(state);
    {
      const std::lock_guard lock(stream->impl->mutex_);
      stream->impl->suspended_.erase(stream);
    }
    stream->impl->connections_.CloseStream(stream->address);
    delete stream;
  }

  // The mutex must be held.
  void WakeStreams() {
    for (Stream* stream : suspended_) MHD_resume_connection(stream->connection);
    suspended_.clear();
  }

  // The library does not monitor suspended connections, so this detects closed ones.
  void ReleaseAbandonedStreams() {
    for (auto next = suspended_.begin(); next != suspended_.end();) {
      Stream* const stream = *next;
      char byte = 0;
      const ssize_t count = recv(stream->socket, &byte, 1, MSG_PEEK | MSG_DONTWAIT);
      stream->gone = count == 0 || (count < 0 && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR);
      if (!stream->gone) {
        ++next;
        continue;
      }
      next = suspended_.erase(next);
      MHD_resume_connection(stream->connection);
    }
  }

  // Runs in a separate thread: closes connections without a timely request, and streams without a reader.
  void CloseDeadConnections() {
    std::unique_lock lock(mutex_);
    while (!wake_.wait_for(lock, kKeepingInterval, [this] { return ending_; })) {
      ReleaseAbandonedStreams();
      connections_.CloseLate(HttpConnections::Clock::now());
    }
  }

  void AnswerSlowly() {
    std::unique_lock lock(mutex_);
    while (true) {
      wake_.wait(lock, [this] { return ending_ || !waiting_.empty(); });
      if (ending_) return;
      Exchange* exchange = waiting_.front();
      waiting_.pop_front();
      lock.unlock();
      // The library does not end a suspended connection, so the exchange stays valid.
      auto reply = Guarded(slow_, exchange->request);
      lock.lock();
      exchange->reply = std::move(reply);
      MHD_resume_connection(exchange->connection);
    }
  }

  HttpOptions options_;
  Quick quick_;
  Slow slow_;
  HttpConnections connections_;
  std::string url_;
  std::set<std::string> hosts_;
  std::atomic<std::uint64_t> requests_{0};

  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Exchange*> waiting_;  // suspended, until a slow thread takes them
  std::set<Stream*> suspended_;    // streams without pending data
  Body event_;                     // newest event
  std::uint64_t event_number_ = 0, beat_number_ = 0;
  bool ending_ = false;
  std::vector<std::thread> threads_;
  MHD_Daemon* daemon_ = nullptr;
};

HttpServer::HttpServer(HttpOptions options, Quick quick, Slow slow)
    : impl_(std::make_unique<Impl>(std::move(options), std::move(quick), std::move(slow))) {}
HttpServer::~HttpServer() = default;
const std::string& HttpServer::url() const { return impl_->url(); }
void HttpServer::Publish(std::uint64_t id, const std::string& data) { impl_->Publish(id, data); }
void HttpServer::Beat() { impl_->Beat(); }
unsigned HttpServer::streams() const { return impl_->streams(); }
std::uint64_t HttpServer::requests() const { return impl_->requests(); }

}  // namespace legopt::client
