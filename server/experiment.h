#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "db/store.h"
#include "server/capability.h"
#include "server/spec.h"

namespace legopt::server {

inline constexpr double kSecondsPerMicrosecond = 1e-6;

/// What the scheduler keeps of one job: 16 bytes, so that a million jobs fit in memory.
struct Job {
  std::int64_t token = 0;  ///< of the latest attempt
  std::uint16_t attempts = 0;
  std::uint16_t returned = 0;
  db::JobState state = db::JobState::kQueued;
  db::AttemptOutcome outcome = db::AttemptOutcome::kRunning;   ///< of the latest attempt
  db::AttemptOutcome previous = db::AttemptOutcome::kRunning;  ///< of the one before, as far as it ended in this life
  bool time_limited : 1 = false;                               ///< done, and the clock stopped its solve
  bool solved : 1 = false;                                     ///< done, and its literal verdict is kSuccess
  /// signal of the latest attempt that crashed by a fault of its own (IsOwnFault), in this life of the server; 0: none
  std::uint8_t fault_signal : 6 = 0;
};
static_assert(sizeof(Job) == 16);

/// How long the solves of a kind of job took that gave a result, and the waypoints of their problems.
struct KindTime {
  double seconds = 0;
  double waypoints = 0;
};

/// An experiment in the scheduler's memory: its spec and the state of its jobs.
class Experiment {
 public:
  Experiment(std::int64_t experiment_id, std::int64_t first_job_id, ExperimentSpec spec);

  std::int64_t experiment_id() const { return experiment_id_; }
  std::int64_t first_job_id() const { return first_job_id_; }
  std::int64_t job_id(std::int64_t index) const { return first_job_id_ + index; }
  const ExperimentSpec& spec() const { return spec_; }
  std::int64_t num_jobs() const { return static_cast<std::int64_t>(jobs_.size()); }
  Job& job(std::int64_t index) { return jobs_[static_cast<std::size_t>(index)]; }
  const Job& job(std::int64_t index) const { return jobs_[static_cast<std::size_t>(index)]; }

  /// Steady time at which the last job ended or the experiment was cancelled; empty while it is active.
  std::optional<std::chrono::microseconds> closed_at;
  /// Its queued jobs that some worker can take, none while it is paused or held, as last accounted for.
  std::int64_t leasable = 0;

  Task TaskOf(std::int64_t index) const { return spec_.tasks[CoordinatesOf(spec_, index).task].task; }

  /// Jobs of one method and one task, which need the same of a worker: a range of the job order.
  struct Group {
    std::int64_t first = 0, end = 0;       ///< jobs [first, end)
    std::vector<Need> needs;               ///< of their worker, beside the build
    std::string method_hash;               ///< of the method
    Task task{};                           ///< task
    std::int64_t queued = 0;               ///< number of queued jobs
    int able_workers = 0;                  ///< number of online workers that can take its jobs
    std::int64_t next_fresh = 0;           ///< jobs before it have been taken at least once
    std::int64_t searched = 0;             ///< results of jobs before it were looked for
    std::set<std::int64_t> returned = {};  ///< queued again
  };
  using Admits = std::function<bool(const Group&)>;  ///< whether a worker can take the jobs of a group

  const std::vector<Group>& groups() const { return groups_; }
  const Group& GroupOf(std::int64_t index) const { return groups_[KindOf(index) / spec_.initializations.size()]; }
  /// Whether TakeQueued would give a job.
  bool HasQueued(const Admits& admits) const;
  /// Takes the next queued job of the admitted groups in the order of work, jobs that came back first; empty when there
  /// is none. The caller makes it leased.
  std::optional<std::int64_t> TakeQueued(const Admits& admits);
  /// Puts a job back that TakeQueued gave.
  void PutBack(std::int64_t index) { MutableGroupOf(index).returned.insert(index); }
  /// The number of queued jobs changes by this with the state of a job.
  void CountQueued(std::int64_t index, int change);
  /// The number of able workers of each admitted group changes by this.
  void CountWorker(const Admits& admits, int change);
  /// No worker is able from here on.
  void ForgetWorkers();
  /// Queued jobs of groups that have able workers.
  std::int64_t num_takable() const { return takable_; }

  /// The next jobs of the admitted groups of which nobody has looked whether a result is known: at most `most`,
  /// [first, end), all of one cell. Empty when the next job is one that came back, was looked at, or is not to be
  /// looked at; TakeQueued gives it then.
  struct Range {
    std::int64_t first = 0, end = 0;
  };
  std::optional<Range> NextUnsearched(std::int64_t most, const Admits& admits);
  /// Somebody has looked.
  void SetSearched(const Range& range) { MutableGroupOf(range.first).searched = range.end; }

  /// CPU time, in microseconds, that an attempt of this job is expected to use: the mean over what is known of its kind
  /// (method and task), else of its task, else what its limits allow at a microsecond a term evaluation, which is more
  /// than it will use.
  std::int64_t ExpectedUse_us(std::int64_t index) const;
  /// An attempt of this job has finished after this much CPU time.
  void NoteUse(std::int64_t index, std::int64_t used_us);

  /// Kind of a job: its cell of the benchmark table, counted in the order of the jobs (method, task, initialisation).
  std::size_t KindOf(std::int64_t index) const;
  const KindTime& kind_time(std::size_t kind) const { return kind_times_[kind]; }
  /// The solve of a job that gave its result took so long.
  void AddTime(std::int64_t index, std::int64_t wall_us);

  /// Time in which a job of it was leased, earlier lives of the server included.
  std::chrono::microseconds worked{0};
  /// What the store knows of times: those of the kinds, and how long it was worked on.
  void TakeUpTimes(const db::OpenExperiment& stored);

 private:
  Group& MutableGroupOf(std::int64_t index) { return groups_[KindOf(index) / spec_.initializations.size()]; }
  void MakeGroups();
  /// Drops jobs from the front of the group's queues that are not queued any more.
  void SkipTaken(Group& group);

  struct Mean {
    std::int64_t sum_us = 0, count = 0;
  };

  std::int64_t experiment_id_;
  std::int64_t first_job_id_;
  ExperimentSpec spec_;
  std::vector<Job> jobs_;
  std::vector<Group> groups_;      ///< method after method
  std::int64_t takable_ = 0;       ///< sum of `queued` of the groups with able workers
  std::vector<Mean> use_of_task_;  ///< of finished attempts in this life of the server
  std::vector<Mean> use_of_kind_;  ///< likewise; method after method
  std::vector<KindTime> kind_times_;
};

/// The rows that make the experiment: cells and jobs numbered from the given ids.
db::NewExperiment MakeNewExperiment(const ExperimentSpec& spec, std::int64_t experiment_id, std::int64_t first_job_id,
                                    std::int64_t first_cell_id);

}  // namespace legopt::server
