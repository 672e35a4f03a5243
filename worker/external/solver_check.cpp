#include "worker/external/solver_check.h"

#include <algorithm>
#include <chrono>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "legopt/input/json.h"
#include "legopt/planning/job_runner.h"
#include "legopt/problem/terms/task_program.h"
#include "legopt/solvers/methods/method.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"
#include "worker/external/line_channel.h"
#include "worker/external/protocol.h"

namespace legopt::external {
namespace {

using Clock = LineChannel::Clock;

/// Counts of messages between legopt and the solver.
struct MessageCounts {
  int evaluations = 0;
  int cancels = 0;
  bool answered_cancel = false;
};

/// Channel that counts messages.
class CountingChannel final : public LineChannel {
 public:
  CountingChannel(std::unique_ptr<LineChannel> channel, MessageCounts* talk)
      : channel_(std::move(channel)), talk_(talk) {}

  void Send(std::string_view line, Clock::time_point deadline) override {
    if (line == CancelLine()) ++talk_->cancels;
    channel_->Send(line, deadline);
  }
  std::optional<std::string> Receive(Clock::time_point deadline) override {
    auto line = channel_->Receive(deadline);
    if (line) Note(TryParseJson(*line).value_or(nullptr));
    return line;
  }

 private:
  void Note(const nlohmann::json& message) {
    if (!message.is_object() || !message.contains("type")) return;
    if (message["type"] == "evaluate") ++talk_->evaluations;
    if (message["type"] == "solution" && talk_->cancels > 0) talk_->answered_cancel = true;
  }

  std::unique_ptr<LineChannel> channel_;
  MessageCounts* talk_;
};

const ProblemDefinition& Shortest(const Dataset& dataset, Task task) {
  const auto& problems = dataset.problems(task);
  if (problems.empty()) {
    throw InputError({dataset.folder().string(), "problems", "", "has no " + std::string(ToString(task)) + " problem",
                      "check with another dataset"});
  }
  return *std::ranges::min_element(problems, {}, [](const auto& problem) { return problem.stances.size(); });
}

/// Returns "3.2 s" or "40 minutes".
std::string DurationText(double duration_s) {
  constexpr double kMinute_s = 60.0, kHour_s = 3600.0, kMany = 2.0;
  if (duration_s >= kMany * kHour_s) return FormatFixed(duration_s / kHour_s, 0) + " hours";
  if (duration_s >= kMany * kMinute_s) return FormatFixed(duration_s / kMinute_s, 0) + " minutes";
  return FormatGeneral(duration_s, 2) + " s";
}

/// Returns the mean number of windows of the dataset's motions.
double MeanWindows(const Dataset& dataset) {
  std::size_t windows = 0;
  for (const ProblemDefinition& problem : dataset.problems(Task::kMotion)) {
    windows += StanceWindows(Task::kMotion, static_cast<int>(problem.stances.size())).size();
  }
  return static_cast<double>(windows) / static_cast<double>(dataset.problems(Task::kMotion).size());
}

/// Returns the time of a motion, estimated from its first window.
std::string DescribeTime(const JobResult& window, const Dataset& dataset) {
  constexpr double kSecondsPerMicrosecond = 1e-6;
  const double window_s = static_cast<double>(window.solve.wall_us) * kSecondsPerMicrosecond;
  return "one window took " + DurationText(window_s) + ", about " + DurationText(window_s * MeanWindows(dataset)) +
         " a motion";
}

std::string Describe(const JobResult& result, const MessageCounts& talk) {
  std::string text = std::string(ToString(result.solve.status)) + " after " + std::to_string(talk.evaluations) +
                     (talk.evaluations == 1 ? " evaluation; " : " evaluations; ");
  return text + (result.evaluation.literal == Verdict::kSuccess
                     ? "the judge accepts it"
                     : "the judge refuses it: " + std::string(ToString(result.evaluation.literal)));
}

class Checker {
 public:
  Checker(ExternalSolvers& solvers, const std::shared_ptr<const Dataset>& dataset)
      : solvers_(solvers),
        registry_(RegistryWith(solvers.declarations(),
                               [this](std::size_t number, const Declaration&) {
                                 return std::make_unique<CountingChannel>(solvers_.Start(number), &talk_);
                               })),
        runner_(dataset, registry_) {}

  std::vector<SolverDiagnostic> Run() {
    Try("hello", [this] { return SayHello(); });
    if (findings_.back().passed) Try("posture", [this] { return SolvePosture(); });
    if (findings_.back().passed) Try("repeats", [this] { return Repeats(); });
    if (findings_.back().passed) Try("motion", [this] { return SolveWindow(); });
    if (findings_.back().passed) Try("cancel", [this] { return ObeysCancel(); });
    return std::move(findings_);
  }

 private:
  using Outcome = std::pair<bool, std::string>;

  void Try(const char* check, const std::function<Outcome()>& work) {
    try {
      const auto [passed, detail] = work();
      findings_.push_back({check, passed, detail});
    } catch (const SolverFault& fault) {
      findings_.push_back({check, false, fault.what()});
    }
  }

  Outcome SayHello() {
    const Declaration& declaration = solvers_.declarations().front();
    const auto begin = Clock::now();
    const auto patience = std::chrono::duration<double>(declaration.timeout_s);
    const auto line = solvers_.Start(0)->Receive(begin + std::chrono::duration_cast<Clock::duration>(patience));
    if (!line) return {false, "the solver wrote nothing within the time-out"};
    const SolverMessage message = ReadMessage(*line, 0);
    const auto* hello = std::get_if<Hello>(&message);
    if (hello == nullptr) return {false, "began with another message"};
    const std::string after = FormatFixed(std::chrono::duration<double>(Clock::now() - begin).count(), 2) + " s";
    return {true, "'" + hello->name + "', version '" + hello->version + "', after " + after};
  }

  JobResult Solve(Task task, std::int64_t effort_limit, const JobHooks& hooks = {}) {
    talk_ = {};
    Job job;
    job.task = task;
    job.problem_id = Shortest(runner_.dataset(), task).id;
    job.method = Method::Of(solvers_.declarations().front().name, registry_);
    job.effort_limit = effort_limit;
    return runner_.Run(job, hooks);
  }

  Outcome SolvePosture() {
    posture_ = Solve(Task::kPosture, 0);
    return {true, Describe(posture_, talk_)};
  }

  /// Solves only the first window of a motion, because a whole motion may take hours.
  Outcome SolveWindow() {
    bool solved = false;
    JobHooks hooks;
    hooks.progress = [&solved](int done, int /*total*/) { solved = done > 0; };
    hooks.cancelled = [&solved] { return solved; };
    motion_ = Solve(Task::kMotion, 0, hooks);
    const std::string evaluations =
        std::to_string(talk_.evaluations) + (talk_.evaluations == 1 ? " evaluation" : " evaluations");
    return {true, (solved ? "the first window is solved after " + evaluations : Describe(motion_, talk_)) + "; " +
                      DescribeTime(motion_, runner_.dataset())};
  }

  Outcome Repeats() {
    const JobResult again = Solve(Task::kPosture, 0);
    const bool equal = again.solve.waypoints == posture_.solve.waypoints && again.solve.status == posture_.solve.status;
    return {equal, equal ? "the same bits, started anew" : "another solution from the same start and seed"};
  }

  Outcome ObeysCancel() {
    const JobResult result = Solve(Task::kMotion, std::max<std::int64_t>(1, motion_.solve.term_evaluations / 2));
    if (talk_.cancels == 0) return {true, "ended by itself before it could be asked to"};
    return {talk_.answered_cancel, talk_.answered_cancel ? "sent its solution" : "sent no solution in time"};
  }

  ExternalSolvers& solvers_;
  MessageCounts talk_;
  SolverRegistry registry_;
  JobRunner runner_;
  JobResult posture_, motion_;
  std::vector<SolverDiagnostic> findings_;
};

}  // namespace

std::vector<SolverDiagnostic> CheckSolver(ExternalSolvers& solvers, const std::shared_ptr<const Dataset>& dataset) {
  return Checker(solvers, dataset).Run();
}

}  // namespace legopt::external
