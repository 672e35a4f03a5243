#include "tests/simulation/simulated_client.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "bus/typed_calls.h"
#include "legopt/types/reply.h"

namespace legopt::simulation {
namespace {

constexpr microseconds kPresence{2'000'000};  // time limit for the server's answer
constexpr microseconds kWork{5'000'000};
constexpr microseconds kAskAgain{300'000};
constexpr microseconds kStatusEvery{2'500'000};
using enum ControlAction;

}  // namespace

SimulatedClient::SimulatedClient(World& world, Record& record, SimulatedServer& server)
    : Process(world), record_(record), server_(server) {}

SimulatedClient::~SimulatedClient() { DestroyObjects(); }

bool SimulatedClient::Start() {
  constexpr std::int64_t kFirstAddress = std::int64_t{1} << 32U;
  endpoint_ = std::make_unique<bus::Endpoint>(
      transport(), kFirstAddress + static_cast<std::int64_t>(world().Draw() >> 2U), world().Draw());
  asking_ = false;
  next_ask_ = world().now();
  next_status_ = world().now() + world().Within(microseconds(0), kStatusEvery);
  return true;
}

void SimulatedClient::DestroyObjects() {
  submission_.reset();
  endpoint_.reset();
}

microseconds SimulatedClient::next_turn() const {
  microseconds next = std::min(next_status_, endpoint_->next_timer().value_or(microseconds::max()));
  if (!asking_ && !plan_.empty()) next = std::min(next, next_ask_);
  return next;
}

void SimulatedClient::Turn() {
  endpoint_->Poll(microseconds(0));
  if (submission_ && submission_->outcome()) TakeSubmitAnswer();
  if (!asking_ && !plan_.empty() && world().now() >= next_ask_) {
    asking_ = true;
    plan_.front().ask(plan_.front());
  }
  if (world().now() >= next_status_) AskStatus();
}

// Without an answer the request is repeated, as by a user or a script.
void SimulatedClient::Answered(bool heard) {
  asking_ = false;
  next_ask_ = world().now() + kAskAgain;
  if (heard) plan_.pop_front();
}

// --- Submissions -----------------------------------------------------------------------------------------------------

void SimulatedClient::Submit(const std::string& submission_id, const std::string& spec_json, std::int64_t num_jobs) {
  legopt_msg::submit_request request{};
  request.submission_id = submission_id;
  request.spec_json = spec_json;
  const auto send = [this, request, num_jobs](const Step& step) {
    record_.OnSubmit(step.submission_id, num_jobs);
    SendSubmission(step.submission_id, request, false);
  };
  plan_.push_back({submission_id, send});
  if (world().Chance(0.3)) plan_.push_back({submission_id, send});
  if (world().Chance(0.2)) {
    auto altered = request;
    nlohmann::json other = nlohmann::json::parse(spec_json);
    other["seed"] = 8;
    altered.spec_json = other.dump();
    plan_.push_back(
        {submission_id, [this, altered](const Step& step) { SendSubmission(step.submission_id, altered, true); }});
  }
}

void SimulatedClient::SendSubmission(const std::string& id, const legopt_msg::submit_request& request, bool altered) {
  submission_ =
      std::make_unique<client::SubmitCall>(*endpoint_, request, client::SubmitCall::Patience{kPresence, kWork});
  on_submitted_ = [this, id, altered](const client::SubmitCall::Outcome& outcome) {
    const SubmitStatus status{outcome.reply.status};
    // The id of a deleted submission is free, so the other content may have it now.
    if (record_.MayBeDeleted(id) && (altered || status == SubmitStatus::kRefused)) return;
    if (altered ? status != SubmitStatus::kRefused
                : status != SubmitStatus::kCreated && status != SubmitStatus::kAlreadyKnown) {
      record_.Violation("wrong state: submission " + id + (altered ? " with other content" : "") +
                        " was answered with status " + std::string(ToString(status)) + " " + outcome.reply.message);
    } else if (!altered) {
      record_.OnSubmitted(id, outcome.reply.experiment_id, outcome.reply.num_jobs);
    }
  };
}

void SimulatedClient::TakeSubmitAnswer() {
  const client::SubmitCall::Outcome outcome = *submission_->outcome();
  submission_.reset();
  if (outcome.ok()) on_submitted_(outcome);
  Answered(outcome.ok());
}

// --- Cancelling, status ----------------------------------------------------------------------------------------------

void SimulatedClient::Cancel(const std::string& submission_id) {
  plan_.push_back({submission_id, [this](const Step& step) { SendCancel(step.submission_id); }});
}

void SimulatedClient::SendCancel(const std::string& submission_id) {
  const auto experiment_id = record_.submissions[submission_id].experiment_id;
  if (!experiment_id) return Answered(false);  // another client's request is in flight
  record_.cancel_asked.insert(*experiment_id);
  legopt_msg::cancel_request request{};
  request.experiment_id = *experiment_id;
  bus::CallOptions options;
  options.timeout = kPresence;
  bus::CallMessage(
      *endpoint_, bus::kServer, request, options,
      [this, id = *experiment_id](bus::CallOutcome<legopt_msg::cancel_reply>&& reply) {
        if (reply.ok() && ControlStatus{reply.reply.status} != ControlStatus::kOk &&
            !record_.delete_asked.contains(id)) {
          record_.Violation("lost: experiment " + std::to_string(id) + " cannot be cancelled: " + reply.reply.message);
        }
        if (reply.ok()) record_.OnCancelled(id, server_.disk().Read());
        Answered(reply.ok());
      });
}

// --- Pause, priority, retry ------------------------------------------------------------------------------------------

void SimulatedClient::StopAndResume(const std::string& submission_id, bool now, microseconds duration) {
  legopt_msg::control_request stop{};
  stop.action = EnumNumber(now ? kPauseNow : kPause);
  if (now) stop.reason = "simulated";
  legopt_msg::control_request go_on{};
  go_on.action = EnumNumber(kResume);
  plan_.push_back({submission_id, [this, stop](const Step& step) { SendControl(step.submission_id, stop); }});
  plan_.push_back({submission_id, [this, duration](const Step&) {
                     Answered(true);
                     next_ask_ = world().now() + duration;
                   }});
  plan_.push_back({submission_id, [this, go_on](const Step& step) { SendControl(step.submission_id, go_on); }});
}

void SimulatedClient::Retry(const std::string& submission_id, bool time_limited) {
  legopt_msg::control_request request{};
  request.action = EnumNumber(time_limited ? kRetryTimeLimits : kRetry);
  plan_.push_back({submission_id, [this, request](const Step& step) { SendControl(step.submission_id, request); }});
}

void SimulatedClient::Delete(const std::string& submission_id) {
  Cancel(submission_id);
  legopt_msg::control_request request{};
  request.action = EnumNumber(kDelete);
  plan_.push_back({submission_id, [this, request](const Step& step) { SendControl(step.submission_id, request); }});
}

void SimulatedClient::Label(const std::string& submission_id, const std::string& text) {
  legopt_msg::control_request request{};
  request.reason = text;
  for (const ControlAction action : {kRename, kTag}) {
    request.action = EnumNumber(action);
    plan_.push_back({submission_id, [this, request](const Step& step) { SendControl(step.submission_id, request); }});
  }
}

void SimulatedClient::RaisePriority(const std::string& submission_id, int priority) {
  legopt_msg::control_request request{};
  request.action = EnumNumber(kPriority);
  request.priority = priority;
  plan_.push_back({submission_id, [this, request](const Step& step) { SendControl(step.submission_id, request); }});
}

void SimulatedClient::SendControl(const std::string& submission_id, legopt_msg::control_request request) {
  const auto experiment_id = record_.submissions[submission_id].experiment_id;
  if (!experiment_id) return Answered(false);
  request.experiment_id = *experiment_id;
  const ControlAction action{request.action};
  const bool stops = action == kPause || action == kPauseNow;
  if (!stops) record_.OnResume(*experiment_id, server_.disk().Read());
  if (action == kRetryTimeLimits) record_.time_limit_retried.insert(*experiment_id);
  if (action == kDelete) record_.delete_asked.insert(*experiment_id);
  bus::CallOptions options;
  options.timeout = kPresence;
  bus::CallMessage(*endpoint_, bus::kServer, request, options,
                   [this, id = *experiment_id, action, stops](bus::CallOutcome<legopt_msg::control_reply>&& reply) {
                     const ControlStatus status{reply.reply.status};
                     const bool done = reply.ok() && status == ControlStatus::kOk;
                     if (done && action == kDelete) record_.OnDeleted(id, server_.disk().Read());
                     const bool unknown = reply.ok() && status == ControlStatus::kUnknownExperiment;
                     if (unknown && !record_.delete_asked.contains(id)) {
                       record_.Violation("lost: experiment " + std::to_string(id) + " cannot be controlled");
                     }
                     if (done && stops) record_.OnStopped(id, action == kPauseNow, server_.disk().Read());
                     Answered(reply.ok());
                   });
}

void SimulatedClient::AskStatus() {
  next_status_ = world().now() + kStatusEvery;
  bus::CallOptions options;
  options.timeout = kStatusEvery / 2;
  std::set<std::int64_t> known;
  for (const auto& [id, submission] : record_.submissions) {
    if (submission.experiment_id) known.insert(*submission.experiment_id);
  }
  bus::CallMessage(*endpoint_, bus::kServer, legopt_msg::status_request{}, options,
                   [this, known, done = done_](bus::CallOutcome<legopt_msg::status_reply>&& reply) {
                     if (reply.ok()) CheckStatus(reply.reply.json, known, done);
                   });
}

// Everything acknowledged or shown before this request still exists, and every job is in one state.
void SimulatedClient::CheckStatus(const std::string& json, std::set<std::int64_t> known,
                                  const std::map<std::int64_t, std::int64_t>& done_before) {
  const auto status = nlohmann::json::parse(json);
  const bool on_disk = status.at("server").at("store_error").get<std::string>().empty();
  for (const auto& experiment : status.at("experiments")) {
    const auto id = experiment.at("id").get<std::int64_t>();
    const auto& jobs = experiment.at("jobs");
    known.erase(id);
    std::int64_t sum = 0;
    for (const char* state : {"queued", "leased", "done", "failed", "dead", "cancelled"}) {
      sum += jobs.at(state).get<std::int64_t>();
    }
    const auto done = jobs.at("done").get<std::int64_t>();
    const auto before = done_before.find(id);
    // Only jobs stopped by the wall-time limit may leave the state done.
    const bool fewer = before != done_before.end() && done < before->second && !record_.time_limit_retried.contains(id);
    if (sum != jobs.at("total").get<std::int64_t>() || fewer) {
      record_.Violation("wrong state: status of experiment " + std::to_string(id) + " shows " + jobs.dump());
    }
    if (on_disk) done_[id] = std::max(done_[id], done);
  }
  for (const std::int64_t id : record_.delete_asked) known.erase(id);
  if (!known.empty()) {
    record_.Violation("lost: status does not list experiment " + std::to_string(*known.begin()));
  }
}

}  // namespace legopt::simulation
