#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "db/memory_store.h"
#include "db/store.h"
#include "tests/temporary_folder.h"

namespace legopt::simulation {

using AttemptKey = std::pair<std::int64_t, int>;  ///< job id, attempt

/// What the database holds, read for the checker.
struct StoredState {
  struct Experiment {
    std::string submission_id;
    db::ExperimentState state{};
    std::int64_t first_job_id = 0;
    std::int64_t num_jobs = 0;
  };
  struct Job {
    std::int64_t experiment_id = 0;
    db::JobState state{};
    int attempts = 0;
    int returned = 0;             ///< of these, not charged
    std::optional<int> accepted;  ///< attempt whose result it has
    double cost = 0;              ///< of that result
    std::int64_t taken_from = 0;  ///< job whose solve made it; 0: this one
  };
  std::map<std::int64_t, Experiment> experiments;
  std::map<std::int64_t, Job> jobs;
  std::map<AttemptKey, db::AttemptRecord> attempts;
  std::set<AttemptKey> stale;  ///< reports kept apart
};

/// Where the database of a simulated server lies: what survives the server's processes.
class Disk {
 public:
  virtual ~Disk() = default;
  /// The store as a new process finds it; it lives until Close. Throws StoreError.
  virtual db::Store& Open() = 0;
  virtual void Close() = 0;
  /// Everything, as of the last commit; open or closed.
  virtual StoredState Read() = 0;
  /// What the store's own checks say; empty when all is well.
  virtual std::string Examine() { return {}; }
};

class MemoryDisk final : public Disk {
 public:
  db::Store& Open() override { return store_; }
  void Close() override {}
  StoredState Read() override;

 private:
  db::MemoryStore store_;
};

/// A database file in a folder of its own, removed at the end.
class SqliteDisk final : public Disk {
 public:
  db::Store& Open() override;
  void Close() override { store_.reset(); }
  StoredState Read() override;
  std::string Examine() override;

 private:
  test::TemporaryFolder folder_{test::TemporaryFolder::Place::kMemory};
  std::unique_ptr<db::Store> store_;
};

}  // namespace legopt::simulation
