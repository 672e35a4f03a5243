#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "db/store.h"
#include "tests/doubles/memory_store.h"
#include "tests/temporary_folder.h"

namespace legopt::simulation {

using AttemptKey = std::pair<std::int64_t, int>;  ///< job id, attempt

/// Content of the database, read for the checker.
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
    int returned = 0;             ///< attempts that were not charged
    std::optional<int> accepted;  ///< attempt whose result was accepted
    double cost = 0;              ///< cost of that result
    std::int64_t taken_from = 0;  ///< job that was solved; 0: this one
  };
  std::map<std::int64_t, Experiment> experiments;
  std::map<std::int64_t, Job> jobs;
  std::map<AttemptKey, db::AttemptRecord> attempts;
  std::set<AttemptKey> stale;  ///< archived reports
};

/// The database of a simulated server, which survives the server's processes.
class Disk {
 public:
  virtual ~Disk() = default;
  /// Opens the store for a new process; it is valid until Close. Throws StoreError.
  virtual db::Store& Open() = 0;
  virtual void Close() = 0;
  /// Returns everything as of the last commit, whether open or closed.
  virtual StoredState Read() = 0;
  /// Returns the findings of the store's own checks; empty if there are none.
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

/// A database file in a temporary folder.
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
