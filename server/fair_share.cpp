#include "server/fair_share.h"

#include <algorithm>

namespace legopt::server {
void FairShare::Add(std::int64_t experiment_id, const std::string& submitter, int priority,
                    const std::string& dataset) {
  Entry& entry = entries_[experiment_id];
  entry.account.senior = experiment_id;
  entry.name = submitter;
  entry.dataset = dataset;
  Enter(entry, priority);
}

void FairShare::Remove(std::int64_t experiment_id) {
  const auto found = entries_.find(experiment_id);
  if (found == entries_.end()) return;
  SetWaiting(experiment_id, false);
  Leave(found->second);
  entries_.erase(found);
}

void FairShare::SetPriority(std::int64_t experiment_id, int priority) {
  Entry& entry = entries_.at(experiment_id);
  const bool waiting = entry.waiting;
  SetWaiting(experiment_id, false);
  Leave(entry);
  entry.account.used_us = 0;
  Enter(entry, priority);
  SetWaiting(experiment_id, waiting);
}

// The expected time of running attempts moves with the entry.
void FairShare::Enter(Entry& entry, int priority) {
  entry.priority = priority;
  Submitter& submitter = levels_[priority].submitters[entry.name];
  entry.submitter = &submitter;
  ++submitter.num_entries;
  const std::int64_t running_us = entry.account.running_us;
  entry.account.running_us = 0;
  Charge(entry, 0, running_us);
}

void FairShare::Leave(Entry& entry) {
  Level& level = levels_.at(entry.priority);
  const std::int64_t running_us = entry.account.running_us;
  Charge(entry, 0, -running_us);
  entry.account.running_us = running_us;
  if (--entry.submitter->num_entries == 0) level.submitters.erase(entry.name);
  if (level.submitters.empty()) levels_.erase(entry.priority);
}

void FairShare::SetWaiting(std::int64_t experiment_id, bool waiting) {
  Entry& entry = entries_.at(experiment_id);
  if (entry.waiting == waiting) return;
  entry.waiting = waiting;
  Level& level = levels_.at(entry.priority);
  if (waiting) {
    BeginToWait(level, entry);
  } else {
    StopWaiting(level, entry);
  }
}

bool FairShare::WaitsFor(const Submitter& submitter, const std::string& dataset) {
  return std::any_of(submitter.waiting.begin(), submitter.waiting.end(),
                     [&](const auto& key) { return WaitsFor(*std::get<Entry*>(key), dataset); });
}

// Returns the used time at which a new member of a group starts; groups are the submitters of a level and the
// experiments of a submitter.
template <class Group>
std::int64_t FairShare::InitialUsedTime(Group& group, const std::string& dataset) {
  std::optional<std::int64_t> least;
  for (const auto& [time, senior, member] : group.waiting) {
    if (!WaitsFor(*member, dataset)) continue;
    least = std::min(least.value_or(member->account.used_us), member->account.used_us);
  }
  return least ? *least : group.stands[dataset];
}

// Stores the used time of a member that stopped waiting for the dataset.
template <class Group, class Member>
void FairShare::RecordUsedTime(Group& group, const std::string& dataset, const Member& member) {
  group.stands[dataset] = member.account.used_us;
}

void FairShare::BeginToWait(Level& level, Entry& entry) {
  Submitter& submitter = *entry.submitter;
  if (!WaitsFor(submitter, entry.dataset)) {
    const std::int64_t beginning = InitialUsedTime(level, entry.dataset);
    if (submitter.waiting.empty()) {
      submitter.account.senior = entry.account.senior;
    } else {
      level.waiting.erase(KeyOf(submitter));
    }
    submitter.account.used_us = std::max(submitter.account.used_us, beginning);
    level.waiting.insert(KeyOf(submitter));
  }
  entry.account.used_us = std::max(entry.account.used_us, InitialUsedTime(submitter, entry.dataset));
  submitter.waiting.insert(KeyOf(entry));
}

void FairShare::StopWaiting(Level& level, Entry& entry) {
  Submitter& submitter = *entry.submitter;
  submitter.waiting.erase(KeyOf(entry));
  RecordUsedTime(submitter, entry.dataset, entry);
  RecordUsedTime(level, entry.dataset, submitter);
  if (submitter.waiting.empty()) level.waiting.erase(KeyOf(submitter));
}

void FairShare::Begin(std::int64_t experiment_id, std::int64_t expected_us) {
  Charge(entries_.at(experiment_id), 0, expected_us);
}

void FairShare::End(std::int64_t experiment_id, std::int64_t expected_us, std::int64_t used_us) {
  Charge(entries_.at(experiment_id), used_us, -expected_us);
}

// The queues are ordered by virtual time, so entries are removed and reinserted.
void FairShare::Charge(Entry& entry, std::int64_t used_us, std::int64_t running_us) {
  Submitter& submitter = *entry.submitter;
  Queue<Submitter>& queue = levels_.at(entry.priority).waiting;
  const bool submitter_waits = !submitter.waiting.empty();
  if (submitter_waits) queue.erase(KeyOf(submitter));
  if (entry.waiting) submitter.waiting.erase(KeyOf(entry));
  for (Account* account : {&entry.account, &submitter.account}) {
    account->used_us += used_us;
    account->running_us += running_us;
  }
  if (entry.waiting) submitter.waiting.insert(KeyOf(entry));
  if (submitter_waits) queue.insert(KeyOf(submitter));
}

std::optional<std::int64_t> FairShare::First(const std::function<bool(std::int64_t experiment_id)>& accepts) const {
  for (const auto& [priority, level] : levels_) {
    for (const auto& [time, senior, submitter] : level.waiting) {
      for (const auto& [own_time, experiment_id, entry] : submitter->waiting) {
        if (accepts(experiment_id)) return experiment_id;
      }
    }
  }
  return std::nullopt;
}

}  // namespace legopt::server
