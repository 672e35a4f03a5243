#include "worker/server_link.h"

#include <optional>
#include <string>
#include <utility>

#include "bus/codec.h"

namespace legopt::worker {
namespace {

constexpr microseconds kResultTimeout = std::chrono::seconds(10);
constexpr microseconds kCallTimeout = std::chrono::seconds(3);

}  // namespace

PoolCalls::PoolCalls(ServerLink& link, Pool& pool)
    : link_(link), pool_(pool), self_(std::make_shared<PoolCalls*>(this)) {}

PoolCalls::~PoolCalls() { *self_ = nullptr; }

template <class Request, class Handler>
void PoolCalls::Ask(const Request& request, microseconds timeout, Handler handler) {
  using Reply = typename bus::CallOf<Request>::Reply;
  link_.Call(bus::CallOf<Request>::kType, bus::Encode(request), timeout,
             [self = self_, handler = std::move(handler)](bus::CallResult&& result) {
               if (*self == nullptr) return;
               if (result.status == bus::CallResult::kRejected && result.code == bus::ErrorCode::kRoleRefused) {
                 (*self)->pool_.OnKeyRefused((*self)->link_.now(), result.error);
               }
               std::string error = result.error;
               std::optional<Reply> reply;
               if (result.status == bus::CallResult::kOk) reply = bus::Decode<Reply>(result.body, &error);
               handler((*self)->pool_, (*self)->link_.now(), reply ? &*reply : nullptr, error);
             });
}

void PoolCalls::CarryOut(const CallHello& action) {
  Ask(action.request, kCallTimeout,
      [](Pool& pool, microseconds now, const legopt_msg::hello_reply* reply, const std::string& error) {
        pool.OnHelloReply(now, reply, error);
      });
}

void PoolCalls::CarryOut(const CallLease& action) {
  Ask(action.request, pool_.lease_call_timeout(),
      [](Pool& pool, microseconds now, const legopt_msg::lease_reply* reply, const std::string& error) {
        pool.OnLeaseReply(now, reply, error);
      });
}

void PoolCalls::CarryOut(const CallHeartbeat& action) {
  Ask(action.request, pool_.heartbeat_interval(),
      [](Pool& pool, microseconds now, const legopt_msg::heartbeat_reply* reply, const std::string& error) {
        pool.OnHeartbeatReply(now, reply, error);
      });
}

void PoolCalls::CarryOut(const CallMethod& action) {
  Ask(action.request, kCallTimeout,
      [hash = action.request.hash](Pool& pool, microseconds now, const legopt_msg::method_reply* reply,
                                   const std::string& error) { pool.OnMethodReply(now, hash, reply, error); });
}

void PoolCalls::CarryOut(const CallResult& action) {
  Ask(*action.request, kResultTimeout,
      [key = action.key](Pool& pool, microseconds now, const legopt_msg::result_reply* reply,
                         const std::string& error) { pool.OnResultReply(now, key, reply, error); });
}

}  // namespace legopt::worker
