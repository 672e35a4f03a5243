#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/network_flags.h"
#include "bus/bridge/uplink.h"
#include "bus/endpoint.h"
#include "bus/lcm_transport.h"
#include "bus/typed_calls.h"

namespace legopt::client {

/// Address and timeout of the server.
struct NetworkOptions : app::NetworkFlags {
  double timeout_s = 5;               ///< time for the first answer, (0, 3600]
  std::optional<std::string> access;  ///< access file of the server: use a bridge
};

/// Calls to the server of a deployment, one at a time. Every call throws ClientError: kUnreachable if no answer arrives
/// in the time that the options give, kCutShort if a query is stopped at its limit, kUsage if the server refuses the
/// request, kInterrupted if the user interrupts the wait (only under an InterruptGuard), kInternal if the answer is
/// invalid. Thread rule: one thread.
class ServerConnection {
 public:
  /// Joins the network without sending anything. Throws bus::BusError.
  explicit ServerConnection(const NetworkOptions& options);
  ~ServerConnection();

  /// Asks for the identity of the server.
  legopt_msg::probe_reply Probe();
  /// Submits a spec; equal ids create one experiment. A refusal is a kUsage error with the server's reason. `tick` is
  /// called twice per second while waiting; it may make other calls, and may throw.
  legopt_msg::submit_reply Submit(const std::string& submission_id, const std::string& spec_json,
                                  const std::function<void()>& tick = {});
  /// Stores the packed dataset of an experiment on the server. `pack` is called if the server needs the archive.
  /// Returns why the archive is not stored; empty if it is on disk.
  std::string StoreDataset(const std::string& hash, const std::function<std::string()>& pack);
  /// Returns the status of one experiment, or of all if `experiment_id` is 0; the JSON of PROTOCOL.md.
  nlohmann::json Status(std::int64_t experiment_id);
  /// Runs read-only SQL, stopped by the server after `limit_s`, (0, 3600]. Returns text for db::ReadJsonRows.
  std::string Query(const std::string& sql, int max_rows, double limit_s);
  legopt_msg::cancel_reply Cancel(std::int64_t experiment_id);
  legopt_msg::control_reply Control(legopt_msg::control_request request);

  /// Address for messages: "239.255.76.67:7667", or the address of the bridge.
  const std::string& address() const { return address_; }
  const bus::LcmTransport& transport() const { return transport_; }
  /// Sets the timeout of later calls.
  void set_timeout(std::chrono::microseconds timeout) { timeout_ = timeout; }

 private:
  template <class Request>
  typename bus::CallOf<Request>::Reply Ask(Request request, std::chrono::microseconds timeout);
  void Await(const std::function<bool()>& answered, const std::function<void()>& tick);
  std::string NoAnswerMessage() const;
  template <class Reply>
  Reply Answer(bus::CallOutcome<Reply> outcome) const;

  ServerConnection(bridge::ServerUplink uplink, double timeout_s);

  bus::LcmOptions options_;
  std::string address_;
  bool bridged_;
  bus::LcmTransport transport_;
  std::unique_ptr<bridge::Bridge> spoke_;  ///< nullptr: the server is on the local bus
  bus::Endpoint endpoint_;
  std::chrono::microseconds timeout_;
};

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
