#include "client/service/server_connection.h"

#include <algorithm>
#include <cmath>
#include <legopt_msg/cancel_request.hpp>
#include <legopt_msg/probe_request.hpp>
#include <legopt_msg/query_reply.hpp>
#include <legopt_msg/query_request.hpp>
#include <legopt_msg/status_reply.hpp>
#include <legopt_msg/status_request.hpp>
#include <legopt_msg/store_dataset_reply.hpp>
#include <legopt_msg/store_dataset_request.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "bus/message_limits.h"
#include "bus/typed_calls.h"
#include "client/client_error.h"
#include "client/service/experiment_status.h"
#include "client/service/interrupt.h"
#include "legopt/types/reply.h"

namespace legopt::client {
namespace {

using std::chrono::microseconds;
// Timeout for large queries and submissions, which may keep a reachable server busy; a probe first checks that it is
// reachable.
constexpr microseconds kWorkTimeout = std::chrono::seconds(120);
constexpr microseconds kLongestCall = std::chrono::hours(1);
constexpr microseconds kPollSlice = std::chrono::milliseconds(100);
constexpr microseconds kTickInterval = std::chrono::milliseconds(500);

microseconds ToMicroseconds(double seconds) {
  return std::chrono::duration_cast<microseconds>(std::chrono::duration<double>(seconds));
}

}  // namespace

// A client has threads and several connections, so it stays in its network namespace.
ServerConnection::ServerConnection(const NetworkOptions& options)
    : ServerConnection(bridge::PrepareUplink(options.Resolve(), options.access, bridge::BusLocation::kOwnPorts),
                       options.timeout_s) {}

ServerConnection::ServerConnection(bridge::ServerUplink uplink, double timeout_s)
    : options_(uplink.network),
      address_(uplink.server_address),
      bridged_(uplink.bridged()),
      transport_(options_),
      spoke_(bridge::RunSpoke(std::move(uplink))),
      endpoint_(transport_, bus::RandomEndpointId(), bus::RandomSeed()),
      timeout_(ToMicroseconds(timeout_s)) {}

ServerConnection::~ServerConnection() = default;

template <class Request>
typename bus::CallOf<Request>::Reply ServerConnection::Ask(Request request, microseconds timeout) {
  using Outcome = bus::CallOutcome<typename bus::CallOf<Request>::Reply>;
  const auto outcome = std::make_shared<std::optional<Outcome>>();
  bus::CallOptions call;
  call.timeout = timeout;
  const auto id = bus::CallMessage(endpoint_, bus::kServer, std::move(request), call,
                                   [outcome](Outcome&& reply) { *outcome = std::move(reply); });
  try {
    Await([&] { return outcome->has_value(); }, {});
  } catch (const ClientError&) {
    endpoint_.Abandon(id);
    throw;
  }
  return Answer(std::move(**outcome));
}

// `tick` may throw before the answer arrives.
void ServerConnection::Await(const std::function<bool()>& answered, const std::function<void()>& tick) {
  microseconds next_tick = endpoint_.now() + kTickInterval;
  while (!answered()) {
    endpoint_.Poll(kPollSlice);
    if (!answered() && tick && endpoint_.now() >= next_tick) {
      tick();
      next_tick = endpoint_.now() + kTickInterval;
    }
    if (!answered() && Interrupted()) throw ClientError(ExitCode::kInterrupted, "interrupted");
  }
}

// A server with another key, or with none, ignores this client, so it is as silent as a missing one.
std::string ServerConnection::NoAnswerMessage() const {
  const std::string key = transport_.key() == nullptr
                              ? std::string()
                              : "does it have the same key as we have in " + options_.key_file + "? Else ";
  if (bridged_) {
    return "no legopt-server answers at " + address_ + "; " + key +
           "look whether it runs with --listen and whether a firewall passes UDP to that port";
  }
  return "no legopt-server answers at " + address_ + "; " + key +
         "start one ('legopt-server --db results.sqlite'), set --port or LEGOPT_PORT to where it listens, or read a "
         "database file with --db" +
         (key.empty() ? ". A server that has a key answers only who has it, too (--key-file)" : "");
}

template <class Reply>
Reply ServerConnection::Answer(bus::CallOutcome<Reply> outcome) const {
  if (outcome.status == bus::CallResult::kTimeout) {
    throw ClientError(ExitCode::kUnreachable, NoAnswerMessage());
  }
  if (!outcome.ok() && outcome.code == bus::ErrorCode::kRoleRefused) {
    throw ClientError(ExitCode::kNotPermitted, "the server at " + address_ + " refused the request: " + outcome.error);
  }
  if (!outcome.ok()) {
    throw ClientError(ExitCode::kUsage, "the server at " + address_ + " refused the request: " + outcome.error);
  }
  return std::move(outcome.reply);
}

legopt_msg::probe_reply ServerConnection::Probe() {
  legopt_msg::probe_request request{};
  request.nonce = 0;
  return Ask(request, timeout_);
}

legopt_msg::submit_reply ServerConnection::Submit(const std::string& submission_id, const std::string& spec_json,
                                                  const std::function<void()>& tick) {
  legopt_msg::submit_request request;
  request.submission_id = submission_id;
  request.spec_json = spec_json;
  const SubmitCall call(endpoint_, std::move(request), {timeout_, kWorkTimeout});
  Await([&] { return call.outcome().has_value(); }, tick);
  auto reply = Answer(*call.outcome());
  if (SubmitStatus{reply.status} == SubmitStatus::kRefused) {
    throw ClientError(ExitCode::kUsage, "the server refused the experiment: " + reply.message);
  }
  return reply;
}

std::string ServerConnection::StoreDataset(const std::string& hash, const std::function<std::string()>& pack) {
  legopt_msg::store_dataset_request request{};
  request.hash = hash;
  auto reply = Ask(request, timeout_);
  if (StoreDatasetStatus{reply.status} == StoreDatasetStatus::kWanted) {
    const std::string archive = pack();
    constexpr auto kMost = static_cast<std::size_t>(bus::fields::kMaxStoredArchiveBytes);
    if (archive.size() > kMost) {
      return "its archive has " + std::to_string(archive.size()) + " bytes, and a database stores at most " +
             std::to_string(kMost);
    }
    request.archive.assign(archive.begin(), archive.end());
    reply = Ask(std::move(request), std::max(timeout_, kWorkTimeout));
  }
  if (StoreDatasetStatus{reply.status} == StoreDatasetStatus::kStored) return {};
  return reply.message.empty() ? "the server did not take it" : reply.message;
}

nlohmann::json ServerConnection::Status(std::int64_t experiment_id) {
  legopt_msg::status_request request{};
  request.experiment_id = experiment_id;
  return ParseStatusText(Ask(request, timeout_).json);
}

std::string ServerConnection::Query(const std::string& sql, int max_rows, double limit_s) {
  Probe();
  legopt_msg::query_request request;
  request.sql = "/*+ MAX_EXECUTION_TIME(" + std::to_string(std::llround(limit_s * 1e3)) + ") */ " + sql;
  request.max_rows = max_rows;
  // Other requests may be answered first.
  auto reply = Ask(request, std::min(std::max(timeout_, ToMicroseconds(limit_s) + kWorkTimeout), kLongestCall));
  const QueryStatus status{reply.status};
  if (status == QueryStatus::kStopped) throw ClientError(ExitCode::kCutShort, "query: " + reply.message);
  if (status != QueryStatus::kOk) throw ClientError(ExitCode::kUsage, "query: " + reply.message);
  return std::move(reply.json);
}

legopt_msg::control_reply ServerConnection::Control(legopt_msg::control_request request) {
  return Ask(std::move(request), timeout_);
}

legopt_msg::cancel_reply ServerConnection::Cancel(std::int64_t experiment_id) {
  legopt_msg::cancel_request request{};
  request.experiment_id = experiment_id;
  return Ask(request, timeout_);
}

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
