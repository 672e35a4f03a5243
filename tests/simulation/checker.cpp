#include "tests/simulation/checker.h"

#include <algorithm>

namespace legopt::simulation {
namespace {

using db::AttemptOutcome;
using db::JobState;

constexpr int kMaxAttempts = 3;  // same value as in ExperimentText

AttemptOutcome OutcomeOf(ReportedOutcome reported) {
  constexpr EnumArray<ReportedOutcome, AttemptOutcome> kOutcomes{
      {AttemptOutcome::kFinished, AttemptOutcome::kCrashed, AttemptOutcome::kTimeLimit, AttemptOutcome::kMemoryLimit,
       AttemptOutcome::kCancelled, AttemptOutcome::kError, AttemptOutcome::kReturned}};
  return kOutcomes[reported];
}

class Checker {
 public:
  Checker(const Record& record, const StoredState& state, const JobBehaviour& manners)
      : record_(record), state_(state), job_behaviour_(manners), faults_(record.violations) {}

  std::vector<std::string> Run() {
    CheckSubmissions();
    for (const auto& [id, job] : state_.jobs) CheckJob(id, job);
    for (const auto& [key, attempt] : state_.attempts) CheckAttempt(key, attempt);
    for (const auto& [key, report] : record_.reports) CheckReport(key, report);
    CheckCancelled();
    return faults_;
  }

 private:
  void Fault(const std::string& what) { faults_.push_back(what); }

  void CheckSubmissions() {
    std::map<std::string, std::int64_t> found;
    for (const auto& [id, experiment] : state_.experiments) {
      const auto submission = record_.submissions.find(experiment.submission_id);
      if (submission == record_.submissions.end()) {
        Fault("unexpected: experiment " + std::to_string(id) + " of submission " + experiment.submission_id);
      } else if (submission->second.num_jobs != experiment.num_jobs) {
        Fault("wrong state: experiment " + std::to_string(id) + " has " + std::to_string(experiment.num_jobs) +
              " jobs");
      }
      if (!found.emplace(experiment.submission_id, id).second) {
        Fault("duplicated: submission " + experiment.submission_id + " made two experiments");
      }
    }
    for (const auto& [id, submission] : record_.submissions) {
      if (!submission.experiment_id) continue;
      const auto stored = found.find(id);
      if (record_.MayBeDeleted(id)) continue;
      if (stored == found.end() || stored->second != *submission.experiment_id) {
        Fault("lost: submission " + id + " was acknowledged as experiment " +
              std::to_string(*submission.experiment_id));
      }
    }
  }

  std::vector<AttemptOutcome> ChargedOutcomes(std::int64_t job, int attempts) const {
    std::vector<AttemptOutcome> outcomes;
    for (int attempt = 1; attempt <= attempts; ++attempt) {
      const auto found = state_.attempts.find({job, attempt});
      if (found == state_.attempts.end() || found->second.outcome == AttemptOutcome::kReturned) continue;
      outcomes.push_back(found->second.outcome);
    }
    return outcomes;
  }

  // A job that reached its time limit, or crashed twice in a row, is not restarted.
  static bool EndsEarly(const std::vector<AttemptOutcome>& charged) {
    if (charged.empty()) return false;
    if (charged.back() == AttemptOutcome::kTimeLimit) return true;
    return charged.size() > 1 && charged.back() == AttemptOutcome::kCrashed &&
           charged[charged.size() - 2] == AttemptOutcome::kCrashed;
  }

  void CheckJob(std::int64_t id, const StoredState::Job& job) {
    const std::string name = "job " + std::to_string(id);
    if ((job.state == JobState::kDone) != job.accepted.has_value()) Fault("wrong state: " + name + ": done or not");
    if (!IsTerminal(job.state)) Fault("lost: " + name + " never ended");
    if (job.taken_from > 0) CheckReused(name, job);
    // A job that would kill its worker may reuse the result of an identical one that did not.
    const std::int64_t solved_as = job.taken_from > 0 ? job.taken_from : id;
    if (job.accepted && AlwaysCrashes(job_behaviour_, solved_as))
      Fault("unexpected: " + name + " is poison and has a result");
    if (job.accepted && job.taken_from == 0 && job.cost != CostOf(id, *job.accepted)) {
      Fault("wrong state: " + name + " has the result of another job or attempt");
    }
    const int charged = job.attempts - job.returned;
    const bool used_up = job.state == JobState::kDead || job.state == JobState::kFailed;
    const bool ended_early = job.state == JobState::kDead && EndsEarly(ChargedOutcomes(id, job.attempts));
    if (used_up ? (charged != kMaxAttempts && !ended_early) : charged > kMaxAttempts) {
      Fault("wrong state: " + name + " is " + std::string(ToString(job.state)) + " after " + std::to_string(charged) +
            " charged attempts");
    }
    const auto& experiment = state_.experiments.at(job.experiment_id);
    if (job.state == JobState::kCancelled && experiment.state != db::ExperimentState::kCancelled) {
      Fault("wrong state: " + name + " is cancelled, its experiment is not");
    }
  }

  // Its result is the accepted one of the solved job, if that still exists.
  void CheckReused(const std::string& name, const StoredState::Job& job) {
    if (job.accepted != 1 || job.attempts != 1) Fault("wrong state: " + name + " took a result over after leases");
    const auto solved = state_.jobs.find(job.taken_from);
    if (solved == state_.jobs.end()) {
      if (!record_.MayBeDeleted(job.taken_from)) Fault("unexpected: " + name + " took a result over from no job");
    } else if (!solved->second.accepted || solved->second.taken_from > 0 || solved->second.cost != job.cost ||
               solved->second.experiment_id == job.experiment_id) {
      Fault("wrong state: " + name + " has another result than job " + std::to_string(job.taken_from));
    }
  }

  // An outcome reported by a worker must come from the worker with the lease.
  void CheckAttempt(const AttemptKey& key, const db::AttemptRecord& attempt) {
    const std::string name = "attempt " + std::to_string(key.second) + " of job " + std::to_string(key.first);
    if (state_.jobs.at(key.first).taken_from > 0) {
      if (record_.leases.contains(attempt.token)) Fault("duplicated: the " + name + ", reused, was leased");
      return;
    }
    if (attempt.outcome == AttemptOutcome::kRunning) Fault("lost: " + name + " runs for ever");
    if (attempt.outcome == AttemptOutcome::kExpired || attempt.outcome == AttemptOutcome::kReturned ||
        attempt.outcome == AttemptOutcome::kCancelled) {
      return;
    }
    const auto report = record_.reports.find({key.first, key.second, attempt.token});
    const bool sent = report != record_.reports.end();
    // A job that was released too often is charged as an error.
    const bool given_back =
        sent && report->second.outcome == ReportedOutcome::kCancelled && attempt.outcome == AttemptOutcome::kError;
    if (!sent || (OutcomeOf(report->second.outcome) != attempt.outcome && !given_back)) {
      Fault("unexpected: " + name + " ended as " + std::string(ToString(attempt.outcome)));
    }
  }

  void CheckReport(const Record::ResultKey& key, const Record::Report& report) {
    const auto& [job_id, attempt, token] = key;
    const std::string name = "report of attempt " + std::to_string(attempt) + " of job " + std::to_string(job_id);
    const auto stored = state_.attempts.find({job_id, attempt});
    if (stored == state_.attempts.end() && record_.MayBeDeleted(job_id)) return;
    if (stored == state_.attempts.end() || stored->second.token != token) {
      return Fault("lost: lease of the " + name);
    }
    for (const ResultStatus answer : report.answers) {
      if (report.outcome == ReportedOutcome::kRefused && answer == ResultStatus::kAccepted) {
        const bool cancelled = stored->second.outcome == AttemptOutcome::kCancelled &&
                               state_.jobs.at(job_id).state == JobState::kCancelled;
        if (stored->second.outcome != AttemptOutcome::kReturned && !cancelled)
          Fault("wrong state: the " + name + ", refused, counts as " + std::string(ToString(stored->second.outcome)));
      } else if (report.outcome == ReportedOutcome::kCancelled || report.outcome == ReportedOutcome::kRefused) {
        const bool settled = answer == ResultStatus::kAccepted || answer == ResultStatus::kDuplicate;
        if (!settled || stored->second.outcome == AttemptOutcome::kFinished) {
          Fault("wrong state: the " + name + ", released, was answered with " + std::string(ToString(answer)));
        }
      } else if (answer == ResultStatus::kAccepted || answer == ResultStatus::kDuplicate) {
        if (stored->second.outcome != OutcomeOf(report.outcome)) Fault("lost: the " + name + " was acknowledged");
        const auto& accepted = state_.jobs.at(job_id).accepted;
        if (report.outcome == ReportedOutcome::kFinished && accepted != attempt && !Retried({job_id, attempt})) {
          Fault("lost: the result in the " + name);
        }
      } else if (answer == ResultStatus::kStale) {
        if (!state_.stale.contains({job_id, attempt})) Fault("lost: the stale " + name + " was not kept");
        if (state_.jobs.at(job_id).accepted == attempt) Fault("wrong state: the " + name + " is stale and accepted");
      } else {
        Fault("wrong state: the " + name + " was refused");
      }
    }
  }

  // A result whose solve was stopped by the wall-time limit is archived when its job is retried.
  bool Retried(const AttemptKey& key) const {
    const std::int64_t experiment = state_.jobs.at(key.first).experiment_id;
    return record_.time_limit_retried.contains(experiment) && state_.stale.contains(key);
  }

  void CheckCancelled() {
    for (const auto& [id, experiment] : state_.experiments) {
      const auto told = record_.results_at_cancel.find(id);
      if (experiment.state == db::ExperimentState::kCancelled && !record_.cancel_asked.contains(id)) {
        Fault("unexpected: experiment " + std::to_string(id) + " is cancelled");
      }
      if (told == record_.results_at_cancel.end()) continue;
      if (experiment.state != db::ExperimentState::kCancelled) {
        Fault("wrong state: experiment " + std::to_string(id) + " was cancelled and is not any more");
      }
      if (AcceptedOf(state_, id) != told->second) {
        Fault("unexpected: results of experiment " + std::to_string(id) + " after it was cancelled");
      }
      if (experiment.state == db::ExperimentState::kActive) {
        Fault("lost: the cancellation of experiment " + std::to_string(id));
      }
    }
  }

  const Record& record_;
  const StoredState& state_;
  const JobBehaviour& job_behaviour_;
  std::vector<std::string> faults_;
};

}  // namespace

std::vector<std::string> FaultsOf(const Record& record, const StoredState& state, const JobBehaviour& manners) {
  return Checker(record, state, manners).Run();
}

}  // namespace legopt::simulation
