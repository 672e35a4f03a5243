#pragma once

#include <poll.h>

#include <chrono>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "bus/endpoint.h"
#include "worker/actions.h"
#include "worker/pool.h"

namespace legopt::worker {

using std::chrono::microseconds;

/// Part of the bus that a supervisor needs: calls to the server, a clock, and one place to wait. Programs use it with
/// an Endpoint; tests answer the calls themselves. One thread; callbacks run inside Wait.
class ServerLink {
 public:
  virtual ~ServerLink() = default;

  virtual microseconds now() const = 0;
  /// Calls the server. `callback` runs once, also on time-out.
  virtual void Call(bus::MessageType type, std::string body, microseconds timeout,
                    std::function<void(bus::CallResult&&)> callback) = 0;
  /// Waits until a callback has run, one of `extra` is ready (sets revents), or `max_wait` has passed.
  virtual void Wait(std::span<pollfd> extra, microseconds max_wait) = 0;
};

/// ServerLink with an Endpoint, which must outlive it.
class EndpointLink final : public ServerLink {
 public:
  explicit EndpointLink(bus::Endpoint& endpoint) : endpoint_(endpoint) {}

  microseconds now() const override { return endpoint_.now(); }
  void Call(bus::MessageType type, std::string body, microseconds timeout,
            std::function<void(bus::CallResult&&)> callback) override {
    bus::CallOptions options;
    options.timeout = timeout;
    // An idle slot waits for these calls, so their retry interval is short. Heartbeats repeat anyway and limit the cost
    // of a silent server.
    if (type == bus::MessageType::kLease || type == bus::MessageType::kMethod) options.max_retry = kSlotWaits;
    endpoint_.Call(bus::kServer, type, std::move(body), options, std::move(callback));
  }
  void Wait(std::span<pollfd> extra, microseconds max_wait) override { endpoint_.PollWith(extra, max_wait); }

 private:
  static constexpr microseconds kSlotWaits = std::chrono::milliseconds(250);

  bus::Endpoint& endpoint_;
};

/// Makes the calls that a Pool requests, over a link to the server. Passes the decoded and validated answers, or the
/// errors, to the pool. Link and pool must outlive this object; answers that arrive after its end are dropped.
///
/// Thread rule: the link's thread.
class PoolCalls {
 public:
  PoolCalls(ServerLink& link, Pool& pool);
  ~PoolCalls();
  PoolCalls(const PoolCalls&) = delete;
  PoolCalls& operator=(const PoolCalls&) = delete;

  void CarryOut(const CallHello& action);
  void CarryOut(const CallLease& action);
  void CarryOut(const CallHeartbeat& action);
  void CarryOut(const CallMethod& action);
  void CarryOut(const CallResult& action);

 private:
  template <class Request, class Handler>
  void Ask(const Request& request, microseconds timeout, Handler handler);

  ServerLink& link_;
  Pool& pool_;
  // Callbacks of calls that end after this object do nothing.
  std::shared_ptr<PoolCalls*> self_;
};

}  // namespace legopt::worker
