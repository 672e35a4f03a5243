#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "bridge/uplink.h"
#include "bus/endpoint.h"
#include "bus/lcm_transport.h"
#include "bus/typed_calls.h"
#include "programs/network_flags.h"

namespace legopt::client {

/// Where the server is, and how long it may take.
struct NetworkOptions : programs::NetworkFlags {
  double timeout_s = 5;               ///< to answer at all, (0, 3600]
  std::optional<std::string> access;  ///< access file of the server: reach it over a bridge
};

/// Calls to the server of a deployment, one at a time. Every call throws ClientError: kUnreachable when no answer came
/// in time or a query was stopped at its limit, kUsage when the server refused the request, kInterrupted when the user
/// interrupted the wait (only under an InterruptGuard), kInternal when the answer is not understood. Thread rule: one
/// thread.
class ServerConnection {
 public:
  /// Joins the network without asking anybody. Throws bus::BusError.
  explicit ServerConnection(const NetworkOptions& options);
  ~ServerConnection();

  /// Who serves there?
  legopt_msg::probe_reply Probe();
  /// Submits a spec; equal ids make one experiment. A refusal is a kUsage error with the server's reason. `tick` is
  /// called twice per second while the answer is awaited; it may make other calls, and may throw.
  legopt_msg::submit_reply Submit(const std::string& submission_id, const std::string& spec_json,
                                  const std::function<void()>& tick = {});
  /// Has the server store the packed dataset of an experiment that it has. `pack` is called if the server wants the
  /// archive. Returns the reason for which the archive is not stored; empty: it is on disk.
  std::string StoreDataset(const std::string& hash, const std::function<std::string()>& pack);
  /// Status of one experiment, or of all with 0; the JSON of the contract.
  nlohmann::json Status(std::int64_t experiment_id);
  /// Read-only SQL, stopped by the server after `limit_s`, (0, 3600]. Returns the text that db::ReadJsonRows reads.
  std::string Query(const std::string& sql, int max_rows, double limit_s);
  legopt_msg::cancel_reply Cancel(std::int64_t experiment_id);
  legopt_msg::control_reply Control(legopt_msg::control_request request);

  /// "239.255.76.67:7667", or where a bridge leads; for messages.
  const std::string& address() const { return address_; }
  const bus::LcmTransport& transport() const { return transport_; }
  /// Changes how long later calls wait for an answer.
  void set_timeout(std::chrono::microseconds timeout) { timeout_ = timeout; }

 private:
  template <class Request>
  typename bus::CallOf<Request>::Reply Ask(Request request, std::chrono::microseconds timeout);
  void Await(const std::function<bool()>& answered, const std::function<void()>& tick);
  std::string NobodyAnswers() const;
  template <class Reply>
  Reply Answer(bus::CallOutcome<Reply> outcome) const;

  ServerConnection(bridge::Uplink uplink, double timeout_s);

  bus::LcmOptions options_;
  std::string address_;
  bool bridged_;
  bus::LcmTransport transport_;
  std::unique_ptr<bridge::Bridge> spoke_;  ///< null: the server is on our bus
  bus::Endpoint endpoint_;
  std::chrono::microseconds timeout_;
};

}  // namespace legopt::client
