// Workers: when they are stored, considered lost, and removed from memory.

#include <algorithm>
#include <utility>
#include <vector>

#include "server/scheduler.h"

namespace legopt::server {

// Returns the worker with this address, after creating it if the address is unknown.
Scheduler::Worker& Scheduler::WorkerOf(bus::EndpointId sender) {
  const auto known = worker_of_endpoint_.find(sender);
  const bool unknown = known == worker_of_endpoint_.end();
  const std::int64_t worker_id = unknown ? next_worker_id_++ : known->second;
  if (unknown) worker_of_endpoint_.emplace(sender, worker_id);
  const auto [worker, created] = workers_.try_emplace(worker_id);
  if (created) {
    worker->second.record.worker_id = worker_id;
    // The address of a removed worker is known only if the worker is stored.
    worker->second.stored = !unknown;
  }
  return worker->second;
}

// Heartbeats change nothing in the store; this stores when the server last heard of a worker.
void Scheduler::StoreSighting(Worker& worker, Ops& ops) {
  worker.stored_seen = worker.last_seen;
  ops.emplace_back(db::PutWorker{worker.record});
}

// Called before the first lease of a worker. Until then the worker has no row, because any process can say hello.
void Scheduler::Enlist(const Instant& now, Worker& worker, Ops& ops) {
  if (worker.stored) return;
  CountNew(worker, 0);
  worker.stored = true;
  StoreSighting(worker, ops);
  ops.emplace_back(db::RecordEvent{"worker_joined", now.wall_us, {}, {}, worker.record.worker_id, worker.record.name});
}

// Sets the memory counted for a worker that is not stored.
void Scheduler::CountNew(Worker& worker, std::size_t bytes) {
  new_worker_bytes_ += bytes;
  new_worker_bytes_ -= worker.new_bytes;
  worker.new_bytes = bytes;
}

void Scheduler::UpdateWorkerStates(const Instant& now, Ops& ops) {
  const microseconds silence = options_.lease + options_.grace;
  std::vector<std::int64_t> forgotten;
  bool any_lost = false;
  for (auto& [id, worker] : workers_) {
    if (!worker.online) {
      const bool silent = worker.last_seen + options_.new_worker_kept <= now.steady;
      if (!worker.stored && silent) forgotten.push_back(id);
      continue;
    }
    const bool lost = worker.leaving || worker.last_seen + silence <= now.steady;
    const bool due = draining_ || lost || worker.stored_seen + options_.sighting <= now.steady;
    if (worker.stored && due && worker.stored_seen != worker.last_seen) StoreSighting(worker, ops);
    if (!lost) continue;
    any_lost = true;
    SetOnline(worker, false);
    if (!worker.stored) continue;
    const char* kind = worker.leaving ? "worker_left" : "worker_lost";
    ops.emplace_back(db::RecordEvent{kind, now.wall_us, {}, {}, id, worker.record.name});
  }
  for (const std::int64_t id : forgotten) EvictNewWorker(id);
  if (any_lost) EvictOfflineWorkers();
}

void Scheduler::EvictNewWorker(std::int64_t worker_id) {
  Worker& worker = workers_.at(worker_id);
  SetOnline(worker, false);
  CountNew(worker, 0);
  worker_of_endpoint_.erase(worker.record.endpoint);
  workers_.erase(worker_id);
}

// If new workers use too much memory, removes those silent for longest; a live one will say hello again. A quarter is
// removed at once, so that not every hello triggers a search.
void Scheduler::LimitNewWorkerMemory(std::int64_t newest) {
  if (new_worker_bytes_ <= options_.max_new_worker_bytes) return;
  std::vector<std::pair<microseconds, std::int64_t>> by_silence;
  for (const auto& [id, worker] : workers_) {
    if (!worker.stored && id != newest) by_silence.emplace_back(worker.last_seen, id);
  }
  std::sort(by_silence.begin(), by_silence.end());
  const std::size_t enough = options_.max_new_worker_bytes / 4 * 3;
  for (const auto& [seen, id] : by_silence) {
    if (new_worker_bytes_ <= enough) break;
    EvictNewWorker(id);
  }
}

// Workers have a new address after every start, so offline ones accumulate. Their rows stay in the store.
void Scheduler::EvictOfflineWorkers() {
  std::vector<std::pair<std::int64_t, std::int64_t>> gone;  // last seen, id
  for (const auto& [id, worker] : workers_) {
    if (worker.stored && !worker.online && worker.leases == 0) gone.emplace_back(worker.record.seen_at_us, id);
  }
  if (gone.size() <= options_.max_gone_workers) return;
  std::sort(gone.begin(), gone.end());
  gone.resize(gone.size() - options_.max_gone_workers);
  for (const auto& [seen, id] : gone) workers_.erase(id);
}

}  // namespace legopt::server
