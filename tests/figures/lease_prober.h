// A worker without processes: leases one job at a time, measures the latency, and reports the job as done.
#pragma once

#include <atomic>
#include <vector>

#include "bus/endpoint.h"
#include "bus/lcm_transport.h"

namespace legopt::figures {

/// Thread safety: constructed, run and destroyed by one thread; `stop` may be set by another.
class LeaseProber {
 public:
  /// Joins as a worker that holds the dataset of StubSpec. Throws BusError; std::runtime_error if no server answers.
  explicit LeaseProber(int port);

  /// Leases and reports until `stop`; a lease every 20 ms at most.
  void Run(const std::atomic<bool>& stop);
  /// Returns the latency of each answered lease call in milliseconds.
  const std::vector<double>& latencies_ms() const { return latencies_ms_; }
  int timeouts() const { return timeouts_; }

 private:
  template <class Message>
  typename bus::CallOf<Message>::Reply Ask(const Message& message, bool* answered);
  void Report(const legopt_msg::lease& lease);

  bus::LcmTransport transport_;
  bus::Endpoint endpoint_;
  legopt_msg::hello_reply registration_;
  std::vector<double> latencies_ms_;
  int timeouts_ = 0;
};

}  // namespace legopt::figures
