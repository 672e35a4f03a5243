#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bus/typed_calls.h"

namespace legopt::client {

/// A submission as asynchronous calls on an endpoint: probes the server, so that a missing one is detected soon, then
/// sends the experiment with a longer timeout.
///
/// It may be repeated with the same id after any outcome, by any process: equal ids create one experiment. The endpoint
/// must outlive it; the destructor abandons the calls. Thread rule: the endpoint's thread.
class SubmitCall {
 public:
  using Outcome = bus::CallOutcome<legopt_msg::submit_reply>;

  struct Patience {
    std::chrono::microseconds presence;  ///< time until a server answers the probe
    std::chrono::microseconds work;      ///< time until it has expanded and committed the experiment
  };

  SubmitCall(bus::Endpoint& endpoint, legopt_msg::submit_request request, const Patience& patience);
  ~SubmitCall();
  SubmitCall(const SubmitCall&) = delete;
  SubmitCall& operator=(const SubmitCall&) = delete;

  /// nullopt while in progress. kTimeout: it is unknown whether the experiment exists.
  const std::optional<Outcome>& outcome() const { return shared_->outcome; }

 private:
  // Kept alive by the callbacks, which may be called after the destruction of this object.
  struct Shared {
    bus::Endpoint& endpoint;
    legopt_msg::submit_request request;
    Patience patience{};
    bus::CallId call = 0;
    std::optional<Outcome> outcome;
  };
  static void Send(const std::shared_ptr<Shared>& shared);

  std::shared_ptr<Shared> shared_;
};

}  // namespace legopt::client
