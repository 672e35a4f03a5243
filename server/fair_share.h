#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>

namespace legopt::server {

/// In which order experiments are served: larger priorities first; among equals the submitter with the least virtual
/// time, and of this one's experiments the one with the least.
///
///     virtual time = CPU time that its ended attempts used + what its running attempts are expected to use
///
/// in microseconds. So submitters share the workers in equal parts, and the experiments of a submitter its part,
/// however long their jobs are and however many are handed out at once. Equal times: the older experiment first.
///
/// Who begins to wait for a dataset (again) begins where the least of those stands that wait for it, what runs not
/// counted, or where the last one stood; its own time counts when it is larger. So it is served at once, is paid
/// nothing for the time without it, and owes nothing for having been alone. Those that do not wait (nothing queued,
/// paused, held) keep their time as it is.
///
/// Cost: the next to be served, and each account, O(log n) in experiments; beginning and ceasing to wait, O(n).
/// No clock, no randomness. Thread rule: one thread.
class FairShare {
 public:
  /// A new experiment, which does not wait yet. `dataset` is the hash of what its workers must hold.
  void Add(std::int64_t experiment_id, const std::string& submitter, int priority, const std::string& dataset);
  /// Nothing of it may run. Unknown ids are ignored.
  void Remove(std::int64_t experiment_id);
  /// It joins the others of that priority as a newcomer.
  void SetPriority(std::int64_t experiment_id, int priority);
  /// Whether it has jobs that may be handed out.
  void SetWaiting(std::int64_t experiment_id, bool waiting);

  /// An attempt was handed out that is expected to use this much; >= 0.
  void Begin(std::int64_t experiment_id, std::int64_t expected_us);
  /// It has ended, having used `used_us` >= 0; `expected_us` as at its begin.
  void End(std::int64_t experiment_id, std::int64_t expected_us, std::int64_t used_us);

  /// The next to be served of those that wait and are accepted; empty when there is none. The others keep their places.
  std::optional<std::int64_t> First(const std::function<bool(std::int64_t experiment_id)>& accepts) const;

 private:
  struct Account {
    std::int64_t used_us = 0;     ///< by attempts that have ended
    std::int64_t running_us = 0;  ///< expected of those that run
    std::int64_t senior = 0;      ///< experiment id that decides between equal times
    std::int64_t time() const { return used_us + running_us; }
  };
  template <class Member>
  using Queue = std::set<std::tuple<std::int64_t, std::int64_t, Member*>>;  ///< by virtual time, then seniority

  struct Submitter;
  struct Entry {  // an experiment
    Account account;
    int priority = 0;
    std::string name, dataset;  // of the submitter; hash
    Submitter* submitter = nullptr;
    bool waiting = false;
  };
  using Stands = std::map<std::string, std::int64_t>;  ///< by dataset: where the last one stood that waited for it
  struct Submitter {
    Account account;
    int num_entries = 0;  ///< waiting or not
    Queue<Entry> waiting;
    Stands stands;
  };
  struct Level {
    std::map<std::string, Submitter> submitters;
    Queue<Submitter> waiting;
    Stands stands;
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
  static std::int64_t BeginningFor(Group& group, const std::string& dataset);
  template <class Group, class Member>
  static void NoteStand(Group& group, const std::string& dataset, const Member& member);
  static void BeginToWait(Level& level, Entry& entry);
  static void CeaseToWait(Level& level, Entry& entry);
  void Charge(Entry& entry, std::int64_t used_us, std::int64_t running_us);

  std::map<int, Level, std::greater<>> levels_;  ///< by priority, largest first
  std::map<std::int64_t, Entry> entries_;        ///< by experiment id
};

}  // namespace legopt::server
