#include "client/service/submit_call.h"

#include <algorithm>
#include <utility>

namespace legopt::client {

SubmitCall::SubmitCall(bus::Endpoint& endpoint, legopt_msg::submit_request request, const Patience& patience)
    : shared_(std::make_shared<Shared>(Shared{endpoint, std::move(request), patience, 0, {}})) {
  bus::CallOptions options;
  options.timeout = patience.presence;
  shared_->call = bus::CallMessage(endpoint, bus::kServer, legopt_msg::probe_request{}, options,
                                   [shared = shared_](bus::CallOutcome<legopt_msg::probe_reply>&& reply) {
                                     if (reply.ok()) return Send(shared);
                                     Outcome outcome;
                                     outcome.status = reply.status;
                                     outcome.code = reply.code;
                                     outcome.error = std::move(reply.error);
                                     shared->outcome = std::move(outcome);
                                   });
}

SubmitCall::~SubmitCall() {
  if (!shared_->outcome) shared_->endpoint.Abandon(shared_->call);
}

void SubmitCall::Send(const std::shared_ptr<Shared>& shared) {
  bus::CallOptions options;
  options.timeout = std::max(shared->patience.presence, shared->patience.work);
  shared->call = bus::CallMessage(shared->endpoint, bus::kServer, std::move(shared->request), options,
                                  [shared](Outcome&& outcome) { shared->outcome = std::move(outcome); });
}

}  // namespace legopt::client
