#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "bus/endpoint.h"
#include "client/service/submit_call.h"
#include "tests/simulation/process.h"
#include "tests/simulation/record.h"
#include "tests/simulation/simulated_server.h"

namespace legopt::simulation {

/// A user at the command line: works through a list of requests, one at a time, each repeated until it is answered,
/// and looks at the status meanwhile. What it was told outlives its process, as a user's memory does.
class SimulatedClient final : public Process {
 public:
  /// All must outlive it. `server` is for the record only: what the disk holds when an answer is heard.
  SimulatedClient(World& world, Record& record, SimulatedServer& server);
  ~SimulatedClient() override;

  /// Submits; then perhaps once more, with the same content or, to be refused, with another one.
  void Submit(const std::string& submission_id, const std::string& spec_json, std::int64_t num_jobs);
  /// Cancels what a submission has made, once it is known.
  void Cancel(const std::string& submission_id);
  /// Stops and, after `duration`, lets go on what a submission has made; with `hold`, gives back what runs.
  void StopAndGoOn(const std::string& submission_id, bool hold, microseconds duration);
  /// Has its failed and dead jobs tried again, and perhaps those that the clock stopped.
  void Retry(const std::string& submission_id, bool time_limited);
  /// Cancels it and, when that is known, deletes it.
  void Delete(const std::string& submission_id);
  /// Gives it another name and a tag.
  void Label(const std::string& submission_id, const std::string& text);
  /// Makes its jobs begin before those of others.
  void Favour(const std::string& submission_id, int priority);
  /// Nothing left to ask.
  bool done() const { return plan_.empty(); }

 private:
  // One request: `ask` starts a call that ends in Answered, now or in a later life.
  struct Step {
    std::string submission_id;
    std::function<void(const Step&)> ask;
  };

  bool Start() override;
  void Turn() override;
  microseconds next_turn() const override;
  void Bury() override;

  void SendSubmission(const std::string& id, const legopt_msg::submit_request& request, bool altered);
  void TakeSubmitAnswer();
  void SendCancel(const std::string& submission_id);
  void SendControl(const std::string& submission_id, legopt_msg::control_request request);
  void AskStatus();
  void CheckStatus(const std::string& json, std::set<std::int64_t> known,
                   const std::map<std::int64_t, std::int64_t>& done_before);
  void Answered(bool heard);

  Record& record_;
  SimulatedServer& server_;
  std::deque<Step> plan_;
  std::unique_ptr<bus::Endpoint> endpoint_;
  std::unique_ptr<client::SubmitCall> submission_;
  std::function<void(const client::SubmitCall::Outcome&)> on_submitted_;
  std::map<std::int64_t, std::int64_t> done_;  // by experiment: the most that a status has shown
  bool asking_ = false;
  microseconds next_ask_{0};
  microseconds next_status_{0};
};

}  // namespace legopt::simulation
