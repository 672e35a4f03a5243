#pragma once

#include <memory>
#include <optional>

#include "db/store.h"

namespace legopt::db {

/// An in-memory Store for tests and simulations. It applies the rules of the schema (an operation that violates them
/// throws kConstraint and changes nothing), its state outlives the scheduler, and it can inject faults.
class MemoryStore : public Store {
 public:
  MemoryStore();
  ~MemoryStore() override;

  void Apply(std::span<const StoreOp> operations) override;
  OpenState LoadOpenState() override;
  std::optional<AttemptRecord> FindAttempt(std::int64_t job_id, int attempt) override;
  std::optional<OpenExperiment> LoadExperiment(std::int64_t experiment_id) override;
  std::optional<std::string> FindMethodOptions(const std::string& hash) override;
  std::optional<std::string> FindDatasetArchive(const std::string& hash) override;
  ArchiveFacts FindArchiveFacts(const std::string& hash) override;
  std::vector<KnownResult> FindKnownResults(const ResultSearch& search) override;

  /// While a code is set, Apply throws it and changes nothing.
  void FailWith(std::optional<StoreErrorCode> code) { fault_ = code; }

  struct Accepted {
    std::int64_t job_id = 0;
    int attempt = 0;
    ResultRecord result;
  };
  std::optional<Accepted> accepted_result(std::int64_t job_id) const;
  std::int64_t num_accepted() const;
  std::int64_t num_stale() const;
  bool has_stale(std::int64_t job_id, int attempt) const;
  std::optional<JobState> job_state(std::int64_t job_id) const;
  int num_attempts(std::int64_t job_id) const;
  /// Returns the job whose solve produced the result of this job; 0 if that is the job itself or there is no result.
  std::int64_t taken_from(std::int64_t job_id) const;

 private:
  struct Tables;
  std::unique_ptr<Tables> tables_;
  std::optional<StoreErrorCode> fault_;
};

}  // namespace legopt::db
