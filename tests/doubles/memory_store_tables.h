#pragma once

// Private to the memory_store*.cpp files.

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "tests/doubles/memory_store.h"

namespace legopt::db {

// Throws StoreError (kConstraint) unless `legal`.
void RequireLegal(bool legal, const std::string& message);

struct MemoryAttempt {
  std::int64_t token = 0;
  std::int64_t worker_id = 0;
  AttemptOutcome outcome = AttemptOutcome::kRunning;
  std::int64_t leased_at_us = 0;
  std::int64_t ended_at_us = 0;  // 0 while it runs
};

// All inputs that determine a result, except the build: hashes of dataset and method, seed, effort limit, task,
// initialization, problem number, repetition.
using JobKey = std::tuple<std::string, std::string, std::int64_t, std::int64_t, Task, Initialization, int, int>;

struct MemoryJob {
  std::int64_t experiment_id = 0;
  JobKey key;
  std::int64_t taken_from = 0;  // 0: result not reused
  std::size_t cell = 0;         // index of the cell in its experiment
  JobState state = JobState::kQueued;
  int returned = 0;
  int max_attempts = 1;
  std::deque<MemoryAttempt> attempts;  // the undo log keeps references to its elements
};

struct MemoryExperiment {
  ExperimentSummary summary;  // state and times; counts come from the jobs
  std::string spec_json;
  std::string dataset_hash;
  std::size_t num_cells = 0;
};

struct MemoryStore::Tables {
  std::map<std::int64_t, MemoryExperiment> experiments;
  std::set<std::string> submissions;
  std::map<std::string, std::string> options;        // key: method hash
  std::map<std::string, std::string> dataset_names;  // key: dataset hash
  std::map<std::string, std::string> archives;       // key: dataset hash
  std::map<std::int64_t, MemoryJob> jobs;
  std::map<std::int64_t, Accepted> results;
  std::set<std::pair<JobKey, std::int64_t>> jobs_by_key;
  std::set<std::pair<std::int64_t, int>> stale;
  std::map<std::int64_t, WorkerRecord> workers;
  std::set<std::int64_t> endpoints;
  std::map<std::int64_t, std::int64_t> cells;                              // cell -> experiment
  std::int64_t deleted_experiment = 0, deleted_job = 0, deleted_cell = 0;  // largest deleted ids
  std::int64_t events = 0;

  // Undo log of the running Apply, latest change last.
  std::vector<std::function<void()>> undo;

  // Assigns `value` and records the old one in the undo log. Rows are elements of maps, so their addresses are stable.
  template <class T>
  void Set(T& place, T value) {
    undo.push_back([&place, old = place] { place = old; });
    place = std::move(value);
  }
  template <class Map, class Key, class Row>
  auto& Insert(Map& map, const Key& key, Row row, const char* what) {
    const auto [where, inserted] = map.emplace(key, std::move(row));
    RequireLegal(inserted, std::string(what) + " exists already");
    undo.push_back([&map, key] { map.erase(key); });
    return where->second;
  }
  // Removes a row. Undo restores the same node, because earlier undo steps may refer to its address.
  template <class Map, class Key>
  void Erase(Map& map, const Key& key) {
    auto node = std::make_shared<typename Map::node_type>(map.extract(key));
    if (!node->empty()) undo.push_back([&map, node] { map.insert(std::move(*node)); });
  }
  template <class Set, class Key>
  void InsertKey(Set& set, const Key& key, const char* what) {
    RequireLegal(set.insert(key).second, std::string(what) + " exists already");
    undo.push_back([&set, key] { set.erase(key); });
  }

  bool HasExperimentOn(const std::string& dataset_hash) const {
    return std::any_of(experiments.begin(), experiments.end(),
                       [&](const auto& entry) { return entry.second.dataset_hash == dataset_hash; });
  }
  MemoryJob& JobOf(std::int64_t job_id) {
    const auto job = jobs.find(job_id);
    RequireLegal(job != jobs.end(), "no job " + std::to_string(job_id));
    return job->second;
  }
  MemoryAttempt& RunningAttempt(std::int64_t job_id, int attempt) {
    MemoryJob& job = JobOf(job_id);
    RequireLegal(job.state == JobState::kLeased && attempt == static_cast<int>(job.attempts.size()) &&
                     job.attempts.back().outcome == AttemptOutcome::kRunning,
                 "job " + std::to_string(job_id) + " does not run attempt " + std::to_string(attempt));
    return job.attempts.back();
  }

  void Do(const CreateExperiment& op);
  void Do(const LeaseJob& op);
  void Do(const EndAttempt& op);
  void Do(const AcceptResult& op);
  void Do(const ReuseResult& op);
  void Do(const RecordStaleResult& op);
  void Do(const CancelExperiment& op);
  void Do(const ControlExperiment& op);
  void Do(const RetryExperiment& op);
  void Do(const DeleteExperiment& op);
  void Do(const RenameExperiment& op);
  void Do(const TagExperiment& op);
  void Do(const FinishExperiment& op);
  void Do(const PutWorker& op);
  void Do(const StoreDataset& op);
  void Do(const RecordEvent& op);
  void Close(std::int64_t experiment_id, ExperimentState state, std::int64_t at_us);
  KnownResult Known(const ResultSearch& search, const ResultSearch::Problem& problem) const;
  bool MayRetry(std::int64_t job_id, const MemoryJob& job, bool time_limited) const;
  MemoryExperiment& ExperimentOf(std::int64_t experiment_id);
  ExperimentSummary Summarize(const MemoryExperiment& row) const;
  OpenExperiment Open(const MemoryExperiment& row) const;
};

}  // namespace legopt::db
