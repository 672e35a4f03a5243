#include "tests/simulation/record.h"

#include <algorithm>

namespace legopt::simulation {

std::int64_t AcceptedOf(const StoredState& state, std::int64_t experiment_id) {
  return std::count_if(state.jobs.begin(), state.jobs.end(), [experiment_id](const auto& job) {
    return job.second.experiment_id == experiment_id && job.second.accepted;
  });
}

void Record::OnSubmitted(const std::string& submission_id, std::int64_t experiment_id, std::int64_t num_jobs) {
  Submission& submission = submissions[submission_id];
  if (submission.experiment_id && *submission.experiment_id != experiment_id && !MayBeDeleted(submission_id) &&
      !delete_asked.contains(experiment_id)) {
    Violation("duplicated: submission " + submission_id + " was acknowledged as experiment " +
              std::to_string(*submission.experiment_id) + " and as " + std::to_string(experiment_id));
  }
  if (num_jobs != submission.num_jobs) {
    Violation("wrong state: submission " + submission_id + " was acknowledged with " + std::to_string(num_jobs) +
              " jobs instead of " + std::to_string(submission.num_jobs));
  }
  // Experiments are numbered in order: the answer about one that was deleted may come after that of its successor.
  if (submission.experiment_id < experiment_id) submission.experiment_id = experiment_id;
}

std::int64_t AttemptsOf(const StoredState& state, std::int64_t experiment_id) {
  std::int64_t attempts = 0;
  for (const auto& [id, job] : state.jobs) attempts += job.experiment_id == experiment_id ? job.attempts : 0;
  return attempts;
}

void Record::OnStopped(std::int64_t experiment_id, bool now, const StoredState& state) {
  attempts_at_stop[experiment_id] = AttemptsOf(state, experiment_id);
  const bool runs = std::any_of(state.jobs.begin(), state.jobs.end(), [experiment_id](const auto& job) {
    return job.second.experiment_id == experiment_id && job.second.state == db::JobState::kLeased;
  });
  if (now && runs)
    Violation("wrong state: a job of experiment " + std::to_string(experiment_id) + " runs though it was stopped");
}

void Record::OnResume(std::int64_t experiment_id, const StoredState& state) {
  const auto stopped = attempts_at_stop.extract(experiment_id);
  if (!stopped.empty() && stopped.mapped() != AttemptsOf(state, experiment_id)) {
    Violation("unexpected: jobs of experiment " + std::to_string(experiment_id) + " were leased while it was stopped");
  }
}

void Record::OnCancelled(std::int64_t experiment_id, const StoredState& state) {
  // A cancellation that came too late has no effect: a retry may still add results.
  const auto experiment = state.experiments.find(experiment_id);
  if (experiment == state.experiments.end() || experiment->second.state != db::ExperimentState::kCancelled) return;
  results_at_cancel.emplace(experiment_id, AcceptedOf(state, experiment_id));
}

void Record::OnDeleted(std::int64_t experiment_id, const StoredState& state) {
  if (state.experiments.contains(experiment_id)) {
    Violation("wrong state: experiment " + std::to_string(experiment_id) + " is there though deleted");
  }
}

bool Record::MayBeDeleted(std::int64_t job_id) const {
  const auto after = first_jobs_.upper_bound(job_id);
  return after != first_jobs_.begin() && delete_asked.contains(std::prev(after)->second);
}

bool Record::MayBeDeleted(const std::string& submission_id) const {
  const auto submission = submissions.find(submission_id);
  return submission != submissions.end() && submission->second.experiment_id &&
         delete_asked.contains(*submission->second.experiment_id);
}

// All leases that have expired end together, so the silence of a worker is charged within one commit.
void Record::OnCommit(std::span<const db::StoreOp> operations) {
  std::map<std::int64_t, int> charged;  // leases that expired because a worker was silent, by worker
  for (const db::StoreOp& operation : operations) {
    if (const auto* create = std::get_if<db::CreateExperiment>(&operation)) {
      const std::int64_t id = create->experiment.experiment_id, first = create->experiment.jobs.front().job_id;
      if (!first_jobs_.empty() && (id <= first_jobs_.rbegin()->second || first <= first_jobs_.rbegin()->first)) {
        Violation("duplicated: experiment " + std::to_string(id) + " or its jobs have numbers that were given before");
      }
      first_jobs_[first] = id;
    }
    if (const auto* put = std::get_if<db::PutWorker>(&operation)) slots_[put->worker.worker_id] = put->worker.slots;
    if (const auto* lease = std::get_if<db::LeaseJob>(&operation)) {
      workers_[{lease->job_id, lease->attempt}] = lease->worker_id;
    }
    const auto* end = std::get_if<db::EndAttempt>(&operation);
    if (end == nullptr || end->outcome != db::AttemptOutcome::kExpired) continue;
    const std::int64_t worker = workers_.at({end->job_id, end->attempt});
    if (++charged[worker] == slots_.at(worker) + 1) {
      Violation("wrong state: the silence of worker " + std::to_string(worker) +
                " cost more attempts than it has slots");
    }
  }
}

void Record::OnLease(const legopt_msg::lease& lease) {
  const auto [known, first] = leases.emplace(lease.token, std::pair(lease.job_id, lease.attempt));
  if (!first && known->second != std::pair(lease.job_id, static_cast<int>(lease.attempt))) {
    Violation("duplicated: a token was given twice, for jobs " + std::to_string(known->second.first) + " and " +
              std::to_string(lease.job_id));
  }
}

void Record::OnRun(std::uint64_t life, std::int64_t job_id) {
  auto& others = running_[job_id];
  for (const auto& [other, excused] : others) {
    if (!excused) Violation("duplicated: two workers run job " + std::to_string(job_id) + " at once");
  }
  others[life] = false;
}

void Record::OnRunEnded(std::uint64_t life, std::int64_t job_id) { running_[job_id].erase(life); }

void Record::ExcusePausedWorker(std::uint64_t life) {
  for (auto& [job, lives] : running_) {
    if (const auto run = lives.find(life); run != lives.end()) run->second = true;
  }
}

void Record::OnReport(const legopt_msg::result_request& request) {
  const Report report{ReportedOutcome{request.outcome}, request.cost, {}};
  const auto [known, first] = reports.emplace(ResultKey{request.job_id, request.attempt, request.token}, report);
  if (!first && known->second.outcome != report.outcome) {
    Violation("wrong state: a worker reported attempt " + std::to_string(request.attempt) + " of job " +
              std::to_string(request.job_id) + " in two ways");
  }
}

void Record::OnAnswer(const legopt_msg::result_request& request, ResultStatus status) {
  reports.at({request.job_id, request.attempt, request.token}).answers.insert(status);
}

}  // namespace legopt::simulation
