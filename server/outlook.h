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

/// What an active experiment may expect.
struct Outlook {
  std::string waiting_for;            ///< why it stands still, for people; empty: it moves
  std::optional<double> remaining_s;  ///< until its end, if all goes on as it does; empty while it stands still
  double share = 0;                   ///< of the slots that work at the moment, [0, 1]
  WorkLeft left;
  /// What its queued jobs need and no worker has, for people: "no worker has solver 'mine' (6b4f8a0d)".
  std::vector<std::string> missing;
};

/// Looks at all experiments of a scheduler at one moment. What is not in memory any more (closed for a while), and what
/// is over, has no outlook.
///
/// An experiment moves while a slot works on a job of it whose worker was heard of lately. Of the jobs that a worker
/// holds, its slots work on those leased first. When nothing moves, the reason is the first of these that is so: the
/// database cannot be written, the experiment is held or paused, the server stops, no worker is connected, workers
/// still load, none has what its jobs need, nothing is heard of those that have it or its jobs, they work on others.
///
/// Thread rule: the scheduler's thread; it may not change while this is used.
class Outlooks {
 public:
  /// `store_error`: why the database cannot be written; empty: it can.
  Outlooks(const Scheduler& scheduler, const Instant& now, std::string store_error);

  Outlook Of(std::int64_t experiment_id) const;
  /// Why an active experiment stands still although the service works on no other in its place; empty: it moves, waits
  /// for its turn, or is over. Cheaper than Of.
  std::string Standstill(std::int64_t experiment_id) const;

 private:
  using Leases = std::vector<LeaseView>;

  bool Heard(const WorkerStatus& worker) const;
  /// Is online and has what jobs of it need.
  bool MayWorkOn(const WorkerStatus& worker, const Experiment& experiment) const;
  std::string WaitingFor(const db::ExperimentSummary& summary, const Experiment& experiment) const;
  std::string WaitingForWorkers(const Experiment& experiment) const;
  std::vector<std::string> Missing(const Experiment& experiment) const;
  std::string MissingFor(const Experiment& experiment, const Experiment::Group& group) const;
  std::string OtherWork(const Experiment& experiment) const;
  WorkLeft Left(const Experiment& experiment) const;
  double SlotsFor(const Experiment& experiment) const;
  bool TakesPart(const db::ExperimentSummary& summary) const;

  const Scheduler& scheduler_;
  Instant now_;
  std::string store_error_;
  std::map<std::int64_t, WorkerStatus> workers_;  // by id
  std::map<std::int64_t, Leases> worked_on_;      // by experiment: a slot works on it, its worker was heard
  std::set<std::int64_t> with_the_silent_;        // experiments of whose jobs workers have some that are not heard
  std::size_t busy_slots_ = 0;
};

}  // namespace legopt::server
