#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bus/typed_calls.h"

namespace legopt::client {

/// One submission as calls on an endpoint, without waiting: asks who serves, so that an absent server is found out
/// soon, then sends the experiment, for which a present server may take its time.
///
/// It may be made again with the same id after any end, by anybody, however often: equal ids make one experiment.
/// The endpoint must outlive it; destroying it gives the calls up. Thread rule: the endpoint's thread.
class SubmitCall {
 public:
  using Outcome = bus::CallOutcome<legopt_msg::submit_reply>;

  struct Patience {
    std::chrono::microseconds presence;  ///< until a server answers at all
    std::chrono::microseconds work;      ///< until it has expanded and committed the experiment
  };

  SubmitCall(bus::Endpoint& endpoint, legopt_msg::submit_request request, const Patience& patience);
  ~SubmitCall();
  SubmitCall(const SubmitCall&) = delete;
  SubmitCall& operator=(const SubmitCall&) = delete;

  /// Empty while under way. kTimeout: unknown whether the experiment exists.
  const std::optional<Outcome>& outcome() const { return shared_->outcome; }

 private:
  // Kept alive by the callbacks, so that they may come after this object's end.
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
