#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "bus/endpoint.h"
#include "client/service/server_connection.h"
#include "tests/simulation/process.h"
#include "tests/simulation/record.h"
#include "tests/simulation/simulated_server.h"

namespace legopt::simulation {

/// A user at the command line: processes a list of requests, one at a time, each repeated until it is answered, and
/// polls the status in between. The received replies outlive its process, like a user's memory.
class SimulatedClient final : public Process {
 public:
  /// All arguments must outlive it. `server` is used only for the record: the content of the disk at each reply.
  SimulatedClient(World& world, Record& record, SimulatedServer& server);
  ~SimulatedClient() override;

  /// Submits an experiment; sometimes again, with the same content or with different content, which must be refused.
  void Submit(const std::string& submission_id, const std::string& spec_json, std::int64_t num_jobs);
  /// Cancels the experiment of a submission, once its id is known.
  void Cancel(const std::string& submission_id);
  /// Stops the experiment of a submission and resumes it after `duration`; with `now`, running jobs are released.
  void StopAndResume(const std::string& submission_id, bool now, microseconds duration);
  /// Retries its failed and dead jobs, and optionally those stopped by the wall-time limit.
  void Retry(const std::string& submission_id, bool time_limited);
  /// Cancels it, waits for the reply, and deletes it.
  void Delete(const std::string& submission_id);
  /// Gives it another name and a tag.
  void Label(const std::string& submission_id, const std::string& text);
  /// Raises its priority.
  void RaisePriority(const std::string& submission_id, int priority);
  /// Returns whether all requests are answered.
  bool done() const { return plan_.empty(); }

 private:
  // One request: `ask` starts a call that ends in Answered, now or in a later process.
  struct Step {
    std::string submission_id;
    std::function<void(const Step&)> ask;
  };

  bool Start() override;
  void Turn() override;
  microseconds next_turn() const override;
  void DestroyObjects() override;

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
  std::map<std::int64_t, std::int64_t> done_;  // experiment -> largest number shown by a status
  bool asking_ = false;
  microseconds next_ask_{0};
  microseconds next_status_{0};
};

}  // namespace legopt::simulation
