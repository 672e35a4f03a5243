#pragma once

#include <memory>

#include "worker/actions.h"
#include "worker/pool.h"
#include "worker/server_link.h"

namespace legopt::worker {

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
