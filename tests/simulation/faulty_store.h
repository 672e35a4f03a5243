#pragma once

#include <functional>
#include <optional>
#include <string>

#include "db/store.h"
#include "tests/simulation/process.h"

namespace legopt::simulation {

/// Active faults of a disk. They outlive the processes affected by them.
struct DiskFaults {
  std::optional<db::StoreErrorCode> writes;  ///< error of every commit
  bool reads = false;                        ///< reading fails with kIo
};

/// The store of a simulated process: its disk may fail, and the process may die before a commit, or after it and
/// before any reply.
class FaultyStore final : public db::Store {
 public:
  using CommitObserver = std::function<void(std::span<const db::StoreOp>)>;

  /// All arguments must outlive it. `on_commit` receives the operations that are on disk now.
  FaultyStore(db::Store& inner, Life& life, const DiskFaults& faults, CommitObserver on_commit)
      : inner_(inner), life_(life), faults_(faults), on_commit_(std::move(on_commit)) {}

  void Apply(std::span<const db::StoreOp> operations) override {
    if (!life_.Pass()) throw ProcessDied{};
    if (faults_.writes) throw db::StoreError(*faults_.writes, "simulated disk: writing fails");
    inner_.Apply(operations);
    on_commit_(operations);
    if (!life_.Pass()) throw ProcessDied{};
  }
  db::OpenState LoadOpenState() override {
    CheckReading();
    return inner_.LoadOpenState();
  }
  std::optional<db::AttemptRecord> FindAttempt(std::int64_t job_id, int attempt) override {
    CheckReading();
    return inner_.FindAttempt(job_id, attempt);
  }
  std::optional<db::OpenExperiment> LoadExperiment(std::int64_t experiment_id) override {
    CheckReading();
    return inner_.LoadExperiment(experiment_id);
  }
  std::optional<std::string> FindMethodOptions(const std::string& hash) override {
    CheckReading();
    return inner_.FindMethodOptions(hash);
  }
  std::optional<std::string> FindDatasetArchive(const std::string& hash) override {
    CheckReading();
    return inner_.FindDatasetArchive(hash);
  }
  db::ArchiveFacts FindArchiveFacts(const std::string& hash) override {
    CheckReading();
    return inner_.FindArchiveFacts(hash);
  }
  std::vector<db::KnownResult> FindKnownResults(const db::ResultSearch& search) override {
    CheckReading();
    return inner_.FindKnownResults(search);
  }
  void Idle() override {
    if (faults_.writes) throw db::StoreError(*faults_.writes, "simulated disk: writing fails");
    inner_.Idle();
  }

 private:
  void CheckReading() const {
    if (faults_.reads) throw db::StoreError(db::StoreErrorCode::kIo, "simulated disk: reading fails");
  }

  db::Store& inner_;
  Life& life_;
  const DiskFaults& faults_;
  CommitObserver on_commit_;
};

}  // namespace legopt::simulation
