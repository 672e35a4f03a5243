#include "worker/external/external_solver.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <utility>

#include "legopt/input/json.h"
#include "worker/external/protocol.h"

namespace legopt::external {
namespace {

using Clock = LineChannel::Clock;

constexpr auto kStopCheckInterval = std::chrono::milliseconds(50);
constexpr std::int64_t kMaxProgressLines = 100'000;  // maximum per solve; each line is stored
constexpr int kMaxRepeats = 1000;                    // consecutive requests for one point; they cost no effort
constexpr int kSeedBits = 53;                        // integers that JSON parsers of all languages read exactly

Clock::time_point After(double duration_s) {
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(duration_s));
}

std::string Seconds(double duration_s) { return Dump(nlohmann::json(duration_s)) + " s"; }

std::uint64_t SeedOf(const SolverContext& context) {
  return context.generator == nullptr ? 0 : (*context.generator)() >> (64 - kSeedBits);
}

const char* TypeOf(const SolverMessage& message) {
  constexpr const char* kTypes[] = {"hello", "evaluate", "progress", "solution"};
  return kTypes[message.index()];
}

}  // namespace

ExternalSolver::ExternalSolver(ExternalOptions options, ExternalProtocol manner, ChannelMaker make_channel)
    : options_(std::move(options)), protocol_(std::move(manner)), make_channel_(std::move(make_channel)) {}

SolverResult ExternalSolver::Solve(Program& program, Eigen::VectorXd& x, const SolverContext& context) {
  SolverResult result;
  program.ProjectOnBounds(x);
  best_ = {x, EvaluateObjective(program, x, scratch_)};
  if (!best_.value.IsFinite()) {
    result.status = SolveStatus::kNumericalFailure;
    result.value = best_.value;
    return result;
  }
  const size_t first_record = NumRecords(context);
  evaluations_ = 0;
  progress_lines_ = 0;
  last_requested_.resize(0);
  seed_ = SeedOf(context);
  if (!budget_end_ && options_.budget_s > 0) budget_end_ = After(options_.budget_s);
  budget_spent_ = false;
  stop_status_ = Stopped(context);
  kept_end_ = false;
  program_ = &program;
  slotted_.Reset(program);
  if (!stop_status_) WithSolverName([&] { RunRounds(program.num_waypoints(), context); });
  x = best_.x;
  result.value = EvaluateObjective(program, x, scratch_);
  result.feasible = Satisfied(result.value);
  result.status = stop_status_.value_or(Verdict(kept_end_));
  result.budget_spent = budget_spent_;
  result.iterations = evaluations_;
  CloseHistory(context, first_record, result.value);
  return result;
}

void ExternalSolver::Start() {
  if (channel_ == nullptr) WithSolverName([this] { RestartSolver(); });
}

void ExternalSolver::WithSolverName(const std::function<void()>& talk) {
  try {
    talk();
  } catch (const SolverFault& fault) {
    channel_.reset();  // discards unread output
    throw SolverFault("solver '" + protocol_.name + "' (external) " + fault.what());
  }
}

void ExternalSolver::RestartSolver() {
  channel_ = make_channel_();
  const auto line = channel_->Receive(After(protocol_.silence_s));
  if (!line) throw SolverFault("did not say hello within " + Seconds(protocol_.silence_s));
  const SolverMessage message = ReadMessage(*line, 0);
  if (!std::holds_alternative<Hello>(message)) {
    throw SolverFault(std::string("began with '") + TypeOf(message) + "' and not with 'hello'");
  }
}

/// Returns the result of the stop check, which also includes the end of the time budget.
std::optional<SolveStatus> ExternalSolver::Stopped(const SolverContext& context) {
  if (const auto stop = context.Stopped()) return stop;
  if (!budget_end_ || Clock::now() < *budget_end_) return std::nullopt;
  budget_spent_ = true;
  return SolveStatus::kTimeLimit;
}

void ExternalSolver::RunRounds(int num_waypoints, const SolverContext& context) {
  if (channel_ == nullptr) RestartSolver();
  Eigen::VectorXd base = best_.x;
  bool got_on = false;
  for (int round = 0; round < options_.max_rounds; ++round) {
    const bool grown = slotted_.Rebase(base);
    if (round > 0 && !grown && !(protocol_.has_no_requests && got_on)) return;
    Send(SolveLineAbout(base, round, num_waypoints));
    const ObjectiveValue start = best_.value;
    const Eigen::VectorXd best_before = best_.x;
    SolutionReport solution = SolveRound(context);
    if ((!stop_status_ || budget_spent_) && !solution.waypoints.empty())
      solution.x = TangentTo(*program_, base, solution.waypoints);
    claim_ = solution.status;
    const bool new_rows = EvaluateSolution(solution, start);
    if (protocol_.has_no_requests && !stop_status_) RecordEnd(context);
    got_on = best_.x != best_before;
    if (protocol_.has_no_requests) stop_status_ = stop_status_ ? stop_status_ : Stopped(context);
    if (stop_status_ || claim_ == ReportedStatus::kLimit || (Satisfied(best_.value) && !new_rows)) return;
    // Starts where the new rows have slots. The best point may be from before they appeared and not include them.
    base = new_rows ? slotted_.x() : best_.x;
  }
}

std::string ExternalSolver::SolveLineAbout(const Eigen::VectorXd& base, int round, int num_waypoints) {
  return SolveLine(slotted_, num_waypoints,
                   {round, seed_, options_.constraint_tolerance, protocol_.settings, RobotJson(*program_, base),
                    protocol_.has_no_requests ? AtStart() : nlohmann::json()});
}

nlohmann::json ExternalSolver::AtStart() {
  ++evaluations_;
  const EvaluateRequest request{
      .id = 0, .x = Eigen::VectorXd::Zero(slotted_.num_variables()), .gradients = true, .contacts = true};
  const bool finite = slotted_.Evaluate(request.x.data());
  return EvaluationJson(slotted_, request, finite, finite ? Contacts() : nlohmann::json());
}

SolutionReport ExternalSolver::SolveRound(const SolverContext& context) {
  for (;;) {
    SolverMessage message = Await(context);
    if (stop_status_) return Cancel();
    if (auto* solution = std::get_if<SolutionReport>(&message)) return std::move(*solution);
    if (auto* request = std::get_if<EvaluateRequest>(&message)) {
      // Checked here and not only during silence: the effort limit then stops at the same request in every repetition.
      stop_status_ = Stopped(context);
      if (stop_status_) return Cancel();
      Answer(std::move(*request), context);
    } else if (const auto* progress = std::get_if<ProgressReport>(&message)) {
      RecordProgress(*progress, context);
    } else {
      throw SolverFault("said 'hello' a second time");
    }
  }
}

SolverMessage ExternalSolver::Await(const SolverContext& context) {
  const Clock::time_point deadline = After(protocol_.silence_s);
  for (;;) {
    const Clock::time_point now = Clock::now();
    // Also checked between lines, for a solver that never pauses.
    if (const auto stop = Stopped(context); stop && *stop != SolveStatus::kEffortLimit) {
      stop_status_ = stop;
      return ProgressReport{};
    }
    if (now >= deadline) throw SolverFault("sent nothing for " + Seconds(protocol_.silence_s));
    if (const auto line = channel_->Receive(std::min(deadline, now + kStopCheckInterval))) {
      return ReadMessage(*line, slotted_.num_variables());
    }
  }
}

void ExternalSolver::Send(const std::string& line) { channel_->Send(line, After(protocol_.silence_s)); }

void ExternalSolver::Answer(EvaluateRequest request, const SolverContext& context) {
  ++evaluations_;
  request.x = request.x.cwiseMax(slotted_.lower()).cwiseMin(slotted_.upper());
  repeats_ = last_requested_.size() == request.x.size() && last_requested_ == request.x ? repeats_ + 1 : 0;
  if (repeats_ >= kMaxRepeats) {
    throw SolverFault("asked for the same point " + std::to_string(kMaxRepeats) + " times in a row");
  }
  last_requested_ = request.x;
  const bool finite = slotted_.Evaluate(request.x.data());
  if (finite) {
    const ObjectiveValue& value = slotted_.value();
    if (evaluations_ == 1 || Better(value, best_.value)) {
      context.Record({.cost = value.cost, .violation = value.max_violation});
    }
    UpdateBest();
  }
  Send(Dump(EvaluationJson(slotted_, request, finite, request.contacts && finite ? Contacts() : nlohmann::json())));
}

// Uses the evaluated point, because the program may have moved since.
nlohmann::json ExternalSolver::Contacts() {
  program_->SetPoint(slotted_.x());
  return ContactsJson(*program_);
}

void ExternalSolver::RecordProgress(const ProgressReport& progress, const SolverContext& context) {
  if (++progress_lines_ > kMaxProgressLines) {
    throw SolverFault("sent more than " + std::to_string(kMaxProgressLines) + " lines of progress in one solve");
  }
  context.Record({.cost = progress.cost, .violation = progress.violation, .accepted = true});
}

SolutionReport ExternalSolver::Cancel() {
  const Clock::time_point deadline = After(protocol_.cancel_grace_s);
  try {
    channel_->Send(CancelLine(), deadline);
    if (auto solution = AwaitAfterCancel(deadline)) return std::move(*solution);
    std::fprintf(stderr, "solver '%s' (external) did not obey 'cancel' and is ended\n", protocol_.name.c_str());
  } catch (const SolverFault& fault) {
    std::fprintf(stderr, "solver '%s' (external) %s after 'cancel'\n", protocol_.name.c_str(), fault.what());
  }
  channel_.reset();
  return {};
}

// Requests in flight are no longer answered.
std::optional<SolutionReport> ExternalSolver::AwaitAfterCancel(Clock::time_point deadline) {
  while (Clock::now() < deadline) {
    const auto line = channel_->Receive(deadline);
    if (!line) return std::nullopt;
    SolverMessage message = ReadMessage(*line, slotted_.num_variables());
    if (auto* solution = std::get_if<SolutionReport>(&message)) return std::move(*solution);
  }
  return std::nullopt;
}

// Decides whether the point returned by the solver becomes the best one. It must be no worse than all previous points.
// An optimum may be deeper within the tolerance than previous points and need only be no worse than the start. Returns
// whether rows without their own slot are active there. After a stop, except at the end of the time budget, nothing is
// evaluated.
bool ExternalSolver::EvaluateSolution(const SolutionReport& solution, const ObjectiveValue& start) {
  kept_end_ = false;
  if ((stop_status_ && !budget_spent_) || solution.x.size() == 0) return false;
  const Eigen::VectorXd dx = solution.x.cwiseMax(slotted_.lower()).cwiseMin(slotted_.upper());
  if (!slotted_.Evaluate(dx.data())) return false;
  const ObjectiveValue& end = slotted_.value();
  const bool optimum = claim_ == ReportedStatus::kConverged && Satisfied(end);
  kept_end_ = optimum ? !Better(start, end) : !Better(best_.value, end);
  if (kept_end_) best_ = {slotted_.x(), slotted_.value()};
  return slotted_.SharedSlotActive(options_.constraint_tolerance);
}

// Records each round of a solver without requests as one step.
void ExternalSolver::RecordEnd(const SolverContext& context) {
  const ObjectiveValue& value = slotted_.value();
  if (!value.IsFinite()) return;
  context.Record({.cost = value.cost, .violation = value.max_violation, .accepted = kept_end_});
}

void ExternalSolver::UpdateBest() {
  if (Better(slotted_.value(), best_.value)) best_ = {slotted_.x(), slotted_.value()};
}

bool ExternalSolver::Better(const ObjectiveValue& a, const ObjectiveValue& b) const {
  if (Satisfied(a) != Satisfied(b)) return Satisfied(a);
  return Satisfied(a) ? a.Objective() < b.Objective() : a.max_violation < b.max_violation;
}

SolveStatus ExternalSolver::Verdict(bool kept_end) const {
  // A feasible best point is an optimum only if it is where a converged solver ended.
  if (Satisfied(best_.value)) {
    return kept_end && claim_ == ReportedStatus::kConverged ? SolveStatus::kConvergedFeasible
                                                            : SolveStatus::kIterationLimit;
  }
  if (claim_ == ReportedStatus::kLimit) return SolveStatus::kIterationLimit;
  return claim_ == ReportedStatus::kFailed ? SolveStatus::kNumericalFailure : SolveStatus::kConvergedInfeasible;
}

}  // namespace legopt::external
