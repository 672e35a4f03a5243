#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "db/store.h"
#include "server/capability.h"
#include "server/spec.h"

namespace legopt::server {

inline constexpr double kSecondsPerMicrosecond = 1e-6;

/// Scheduler state of a job: 16 bytes, so that a million jobs fit in memory.
struct Job {
  std::int64_t token = 0;  ///< token of the latest attempt
  std::uint16_t attempts = 0;
  std::uint16_t returned = 0;
  db::JobState state = db::JobState::kQueued;
  db::AttemptOutcome outcome = db::AttemptOutcome::kRunning;   ///< outcome of the latest attempt
  db::AttemptOutcome previous = db::AttemptOutcome::kRunning;  ///< outcome of the attempt before, if it ended since the
                                                               ///< server started
  bool time_limited : 1 = false;                               ///< done, but the solve was stopped by the wall-time
                                                               ///< limit
  bool solved : 1 = false;                                     ///< done, and solved according to the experiment's rule
  /// signal of the latest crash caused by the job itself (IsOwnFault) since the server started; 0: none
  std::uint8_t fault_signal : 6 = 0;
};
static_assert(sizeof(Job) == 16);

/// Total solve time of the results of a kind of jobs, and the number of waypoints of their problems.
struct KindTime {
  double seconds = 0;
  double waypoints = 0;
};

/// An experiment in memory: its spec and the state of its jobs.
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

  /// Steady time at which the last job ended or the experiment was cancelled; nullopt while it is active.
  std::optional<std::chrono::microseconds> closed_at;
  /// Number of queued jobs that some worker can take, as last computed by the scheduler; 0 while paused.
  std::int64_t leasable = 0;

  Task TaskOf(std::int64_t index) const { return spec_.tasks[CoordinatesOf(spec_, index).task].task; }

  /// Jobs of one method and task: a contiguous range of jobs with the same requirements. A position counts them in the
  /// order in which they start (see TakeQueued).
  struct Group {
    std::int64_t first = 0, end = 0;    ///< jobs [first, end)
    std::size_t task_index = 0;         ///< index of the task in the spec
    std::vector<JobRequirement> needs;  ///< requirements except the build
    std::string method_hash;
    Task task{};
    std::int64_t queued = 0;               ///< number of queued jobs
    int able_workers = 0;                  ///< number of online workers that can run its jobs
    std::int64_t next_fresh = 0;           ///< position; all earlier jobs have been taken at least once
    std::int64_t searched = 0;             ///< position; reusable results have been searched for all earlier jobs
    std::set<std::int64_t> returned = {};  ///< re-queued jobs

    bool HasFresh() const { return next_fresh < end - first; }
  };
  using Admits = std::function<bool(const Group&)>;  ///< whether a worker can run the jobs of a group

  const std::vector<Group>& groups() const { return groups_; }
  const Group& GroupOf(std::int64_t index) const { return groups_[KindOf(index) / spec_.initializations.size()]; }
  /// Returns whether TakeQueued would return a job.
  bool HasQueued(const Admits& admits) const;
  /// Takes the next queued job of the admitted groups, re-queued jobs first; nullopt if there is none. The caller must
  /// set its state to leased.
  ///
  /// Jobs start in blocks: all methods on one problem from one initialization, in a random order that is drawn for each
  /// block from the experiment's seed. Tasks follow each other; within a task, repetitions, initializations and
  /// problems. So the jobs of a block start close together, and no method is always first.
  std::optional<std::int64_t> TakeQueued(const Admits& admits);
  /// Re-queues a job that TakeQueued returned.
  void PutBack(std::int64_t index) { MutableGroupOf(index).returned.insert(index); }
  /// Updates the number of queued jobs when the state of a job changes.
  void CountQueued(std::int64_t index, int change);
  /// Adds `change` to the number of able workers of each admitted group.
  void CountWorker(const Admits& admits, int change);
  /// Sets the number of able workers of all groups to 0.
  void ClearWorkerCounts();
  /// Number of queued jobs in groups that have able workers.
  std::int64_t num_takable() const { return takable_; }

  /// Returns the next jobs of an admitted group for which no reusable results have been searched: at most `most` jobs,
  /// in the order in which they start. Groups of the earliest unfinished task come first. Empty if TakeQueued should be
  /// called instead: jobs were re-queued, the next ones have been searched, or the experiment does not reuse results.
  std::vector<std::int64_t> NextUnsearched(std::int64_t most, const Admits& admits);
  /// Marks jobs as searched: those that the last call of NextUnsearched returned, which must not be empty.
  void SetSearched(const std::vector<std::int64_t>& jobs);
  /// Returns whether TakeQueued can take the group's next job without a search.
  bool IsSearched(const Group& group) const {
    return spec_.again || !group.returned.empty() || group.next_fresh < group.searched;
  }

  /// Returns the expected CPU time of an attempt of this job in microseconds: the mean of its kind (method and task) if
  /// known, else of its task, else an upper bound from its limits at one microsecond per term evaluation.
  std::int64_t ExpectedUse_us(std::int64_t index) const;
  /// Records the CPU time of a finished attempt.
  void NoteUse(std::int64_t index, std::int64_t used_us);

  /// Returns the kind of a job: the index of its cell in the benchmark table, in job order (method, task,
  /// initialization).
  std::size_t KindOf(std::int64_t index) const;
  const KindTime& kind_time(std::size_t kind) const { return kind_times_[kind]; }
  /// Records the wall time of a solve that produced a result.
  void AddTime(std::int64_t index, std::int64_t wall_us);

  /// Time during which at least one of its jobs was leased, including previous runs of the server.
  std::chrono::microseconds worked{0};
  /// Restores solve times and total working time from the store.
  void RestoreTimes(const db::OpenExperiment& stored);

 private:
  Group& MutableGroupOf(std::int64_t index) { return groups_[KindOf(index) / spec_.initializations.size()]; }
  void MakeGroups();
  /// Removes jobs that are no longer queued from the front of the group's queues.
  void SkipTaken(Group& group);
  /// Returns the index of the job at a position of the group, 0 <= position < end - first.
  std::int64_t JobAt(const Group& group, std::int64_t position) const;
  /// Returns the place of the group's next fresh job among those of all groups: the smallest one starts first.
  std::tuple<std::size_t, std::int64_t, std::uint64_t> PlaceOf(const Group& group) const;

  struct Mean {
    std::int64_t sum_us = 0, count = 0;
  };

  std::int64_t experiment_id_;
  std::int64_t first_job_id_;
  ExperimentSpec spec_;
  std::vector<Job> jobs_;
  std::vector<Group> groups_;      ///< sorted by method
  std::int64_t takable_ = 0;       ///< total of `queued` over groups with able workers
  std::vector<Mean> use_of_task_;  ///< finished attempts since the server started
  std::vector<Mean> use_of_kind_;  ///< finished attempts since the server started; in method order
  std::vector<KindTime> kind_times_;
};

/// Returns the database rows of an experiment; jobs and cells are numbered starting at the given ids.
db::NewExperiment MakeNewExperiment(const ExperimentSpec& spec, std::int64_t experiment_id, std::int64_t first_job_id,
                                    std::int64_t first_cell_id);

}  // namespace legopt::server
