#pragma once

#include <memory>
#include <optional>

#include "db/store.h"

namespace legopt::db {

/// The Store without a disk, for tests and simulations: the same rules (an operation that the schema would refuse is a
/// kConstraint error and nothing happens), state that outlives the scheduler that wrote it, and faults on demand.
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

  /// While set, Apply throws this code and changes nothing.
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
  /// The job whose solve made the result of this one; 0: itself, or it has none.
  std::int64_t taken_from(std::int64_t job_id) const;

 private:
  struct Tables;
  std::unique_ptr<Tables> tables_;
  std::optional<StoreErrorCode> fault_;
};

}  // namespace legopt::db
