#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>

namespace legopt::server {

/// Order in which experiments are served: by decreasing priority; within a priority, first the submitter with the
/// smallest virtual time, and of its experiments the one with the smallest virtual time.
///
///     virtual time = CPU time used by ended attempts + expected CPU time of running attempts
///
/// Times are in microseconds. Thus submitters get equal shares of the workers, and the experiments of a submitter get
/// equal parts of its share, independent of the length of their jobs and the number handed out at once. Ties: the older
/// experiment is served first.
///
/// An experiment that starts (or resumes) waiting for a dataset starts at the smallest used time of those waiting for
/// the same dataset, not counting running attempts, or, if there are none, at the used time of the last one that
/// waited; or at its own time if that is larger. Thus it is served promptly, gets no credit for the time it did not
/// wait, and pays no penalty for having used idle workers alone. Experiments that do not wait (nothing queued, paused,
/// held) keep their virtual time.
///
/// Complexity in the number n of experiments: choosing the next one and each charge, O(log n); starting and stopping to
/// wait, O(n). Uses no clock and no random numbers. Thread rule: one thread.
class FairShare {
 public:
  /// Adds an experiment, which does not wait yet. `dataset` is the content hash of the dataset that its workers need.
  void Add(std::int64_t experiment_id, const std::string& submitter, int priority, const std::string& dataset);
  /// Removes an experiment, which must have no running attempts. Unknown ids are ignored.
  void Remove(std::int64_t experiment_id);
  /// Moves an experiment to another priority, where it starts like a new one.
  void SetPriority(std::int64_t experiment_id, int priority);
  /// Sets whether the experiment has jobs that may be handed out.
  void SetWaiting(std::int64_t experiment_id, bool waiting);

  /// Charges an attempt that starts with its expected CPU time, >= 0.
  void Begin(std::int64_t experiment_id, std::int64_t expected_us);
  /// Replaces the expected CPU time of an ended attempt (same value as in Begin) by the used time, >= 0.
  void End(std::int64_t experiment_id, std::int64_t expected_us, std::int64_t used_us);

  /// Returns the next waiting experiment accepted by `accepts`; nullopt if none. The queues do not change.
  std::optional<std::int64_t> First(const std::function<bool(std::int64_t experiment_id)>& accepts) const;

 private:
  struct Account {
    std::int64_t used_us = 0;     ///< CPU time used by ended attempts
    std::int64_t running_us = 0;  ///< expected CPU time of running attempts
    std::int64_t senior = 0;      ///< experiment id that breaks ties
    std::int64_t time() const { return used_us + running_us; }
  };
  template <class Member>
  using Queue = std::set<std::tuple<std::int64_t, std::int64_t, Member*>>;  ///< ordered by virtual time, then seniority

  struct Submitter;
  struct Entry {  // an experiment
    Account account;
    int priority = 0;
    std::string name, dataset;  // submitter's name; dataset hash
    Submitter* submitter = nullptr;
    bool waiting = false;
  };
  using LastUsedTimes = std::map<std::string, std::int64_t>;  ///< used time of the last one that waited; key: dataset
  struct Submitter {
    Account account;
    int num_entries = 0;
    Queue<Entry> waiting;
    LastUsedTimes stands;
  };
  struct Level {
    std::map<std::string, Submitter> submitters;
    Queue<Submitter> waiting;
    LastUsedTimes stands;
  };

  template <class Member>
  static std::tuple<std::int64_t, std::int64_t, Member*> KeyOf(Member& member) {
    return {member.account.time(), member.account.senior, &member};
  }
  void Enter(Entry& entry, int priority);
  void Leave(Entry& entry);
  static bool WaitsFor(const Entry& entry, const std::string& dataset) { return entry.dataset == dataset; }
  static bool WaitsFor(const Submitter& submitter, const std::string& dataset);
  template <class Group>
  static std::int64_t InitialUsedTime(Group& group, const std::string& dataset);
  template <class Group, class Member>
  static void RecordUsedTime(Group& group, const std::string& dataset, const Member& member);
  static void BeginToWait(Level& level, Entry& entry);
  static void StopWaiting(Level& level, Entry& entry);
  void Charge(Entry& entry, std::int64_t used_us, std::int64_t running_us);

  std::map<int, Level, std::greater<>> levels_;  ///< key: priority, largest first
  std::map<std::int64_t, Entry> entries_;        ///< key: experiment id
};

}  // namespace legopt::server
