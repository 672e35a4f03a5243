#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/estimate.h"
#include "server/scheduler.h"

namespace legopt::server {

/// Expected course of an active experiment.
struct ExperimentForecast {
  std::string waiting_for;            ///< why it stalls, for display; empty while it progresses
  std::optional<double> remaining_s;  ///< estimated time until its end; nullopt while it stalls
  double share = 0;                   ///< share of the busy slots that work on it, [0, 1]
  WorkLeft left;
  /// Requirements of its queued jobs that no worker satisfies, for display: "no worker has solver 'mine' (6b4f8a0d)".
  std::vector<std::string> missing;
};

/// A snapshot of all experiments of a scheduler at one time. Experiments that are finished or no longer in memory have
/// an empty Outlook.
///
/// An experiment progresses while a slot runs one of its jobs on a worker with recent messages. Of the jobs leased to a
/// worker, its slots run those leased first. If nothing progresses, the reason is the first of these that applies: the
/// database cannot be written; the experiment is paused; the server is stopping; no worker is connected;
/// workers are still loading; no worker satisfies the requirements; no recent message from suitable workers or from
/// workers with its jobs; the workers work on other experiments.
///
/// Thread rule: the scheduler's thread. The scheduler must not change during the lifetime of this object.
class ForecastSnapshot {
 public:
  /// `store_error`: why the database cannot be written; empty if it can.
  ForecastSnapshot(const Scheduler& scheduler, const Instant& now, std::string store_error);

  ExperimentForecast Of(std::int64_t experiment_id) const;
  /// Returns why an active experiment stalls although the workers do not work on others instead; empty if it
  /// progresses, waits for its turn, or is finished. Cheaper than Of.
  std::string StallReason(std::int64_t experiment_id) const;

 private:
  using Leases = std::vector<LeaseView>;

  bool IsResponsive(const WorkerStatus& worker) const;
  /// Returns whether the worker is online and satisfies the requirements of its jobs.
  bool IsSuitable(const WorkerStatus& worker, const Experiment& experiment) const;
  std::string WaitingFor(const db::ExperimentSummary& summary, const Experiment& experiment) const;
  std::string WaitingForWorkers(const Experiment& experiment) const;
  std::vector<std::string> Missing(const Experiment& experiment) const;
  std::string MissingFor(const Experiment& experiment, const Experiment::Group& group) const;
  std::string OccupyingExperiments(const Experiment& experiment) const;
  WorkLeft Left(const Experiment& experiment) const;
  double SlotsFor(const Experiment& experiment) const;
  bool CompetesForSlots(const db::ExperimentSummary& summary) const;

  const Scheduler& scheduler_;
  Instant now_;
  std::string store_error_;
  std::map<std::int64_t, WorkerStatus> workers_;  // key: worker id
  std::map<std::int64_t, Leases> worked_on_;      // running leases of workers with recent messages; key: experiment
  std::set<std::int64_t> waiting_for_silent_workers_;  // experiments with leases of workers without recent messages
  std::size_t busy_slots_ = 0;
};

}  // namespace legopt::server
