#include "server/fair_share.h"

#include <algorithm>
#include <limits>

namespace legopt::server {
namespace {

// Where a newcomer begins: the least use of the members of a queue, not empty, that compete with it; of all, when none
// does.
template <class Queue, class Competes>
std::int64_t LeastUse(const Queue& queue, const Competes& competes) {
  constexpr std::int64_t kNobody = std::numeric_limits<std::int64_t>::max();
  std::int64_t least = kNobody, least_of_all = kNobody;
  for (const auto& [time, senior, member] : queue) {
    least_of_all = std::min(least_of_all, member->account.used_us);
    if (competes(*member)) least = std::min(least, member->account.used_us);
  }
  return least == kNobody ? least_of_all : least;
}

}  // namespace

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

// Those that run go along.
void FairShare::Enter(Entry& entry, int priority) {
  entry.priority = priority;
  Submitter& submitter = levels_[priority].submitters[entry.name];
  entry.submitter = &submitter;
  submitter.entries.insert(&entry);
  const std::int64_t running_us = entry.account.running_us;
  entry.account.running_us = 0;
  Charge(entry, 0, running_us);
}

void FairShare::Leave(Entry& entry) {
  Level& level = levels_.at(entry.priority);
  const std::int64_t running_us = entry.account.running_us;
  Charge(entry, 0, -running_us);
  entry.account.running_us = running_us;
  entry.submitter->entries.erase(&entry);
  if (entry.submitter->entries.empty()) level.submitters.erase(entry.name);
  if (level.submitters.empty()) levels_.erase(entry.priority);
}

void FairShare::SetWaiting(std::int64_t experiment_id, bool waiting) {
  Entry& entry = entries_.at(experiment_id);
  if (entry.waiting == waiting) return;
  entry.waiting = waiting;
  Level& level = levels_.at(entry.priority);
  if (waiting) return BeginToWait(level, entry);
  Submitter& submitter = *entry.submitter;
  submitter.waiting.erase(KeyOf(entry));
  if (submitter.waiting.empty()) level.waiting.erase(KeyOf(submitter));
}

void FairShare::BeginToWait(Level& level, Entry& entry) {
  Submitter& submitter = *entry.submitter;
  const auto wants_same = [&entry](const Entry& other) { return other.dataset == entry.dataset; };
  if (submitter.waiting.empty()) {
    if (level.waiting.empty()) {
      for (auto& [name, other] : level.submitters) other.account.used_us = 0;
    } else {
      const std::int64_t least = LeastUse(level.waiting, [&](const Submitter& other) {
        return std::any_of(other.waiting.begin(), other.waiting.end(),
                           [&](const auto& key) { return wants_same(*std::get<Entry*>(key)); });
      });
      submitter.account.used_us = std::max(submitter.account.used_us, least);
    }
    submitter.account.senior = entry.account.senior;
    level.waiting.insert(KeyOf(submitter));
    for (Entry* own : submitter.entries) own->account.used_us = 0;
  } else {
    entry.account.used_us = std::max(entry.account.used_us, LeastUse(submitter.waiting, wants_same));
  }
  submitter.waiting.insert(KeyOf(entry));
}

void FairShare::Begin(std::int64_t experiment_id, std::int64_t expected_us) {
  Charge(entries_.at(experiment_id), 0, expected_us);
}

void FairShare::End(std::int64_t experiment_id, std::int64_t expected_us, std::int64_t used_us) {
  Charge(entries_.at(experiment_id), used_us, -expected_us);
}

// Queues are ordered by what changes here.
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

std::optional<std::int64_t> FairShare::First(const std::function<bool(const std::string& dataset)>& accepts) const {
  for (const auto& [priority, level] : levels_) {
    for (const auto& [time, senior, submitter] : level.waiting) {
      for (const auto& [own_time, experiment_id, entry] : submitter->waiting) {
        if (accepts(entry->dataset)) return experiment_id;
      }
    }
  }
  return std::nullopt;
}

}  // namespace legopt::server
