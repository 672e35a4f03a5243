#pragma once

// Private to the sqlite_store*.cpp files.

#include <filesystem>
#include <map>

#include "db/connection.h"
#include "db/database_file.h"
#include "db/store.h"

namespace legopt::db {

class SqliteStore final : public Store {
 public:
  explicit SqliteStore(const std::filesystem::path& path);
  ~SqliteStore() override;

  void Apply(std::span<const StoreOp> operations) override;
  OpenState LoadOpenState() override;
  std::optional<AttemptRecord> FindAttempt(std::int64_t job_id, int attempt) override;
  std::optional<OpenExperiment> LoadExperiment(std::int64_t experiment_id) override;
  std::optional<std::string> FindMethodOptions(const std::string& hash) override;
  std::optional<std::string> FindDatasetArchive(const std::string& hash) override;
  ArchiveFacts FindArchiveFacts(const std::string& hash) override;
  std::vector<KnownResult> FindKnownResults(const ResultSearch& search) override;
  void CheckPlace() override;
  void Idle() override;

 private:
  // Prepared statements; their SQL is in sqlite_statements.h.
  struct Statements {
    explicit Statements(Connection& connection);
    Statement lease_job, insert_attempt, end_attempt, end_job, insert_result, insert_waypoint, insert_unsolved,
        insert_violation;
    Statement insert_stale;
    Statement cancel_attempts, cancel_jobs, control_experiment, retry_jobs, reopen_experiment, close_experiment;
    Statement put_worker, insert_event, count_commit;
    Statement put_dataset, find_dataset, put_method, find_method;
    Statement find_problems, insert_problem, insert_problem_batch;
    Statement insert_experiment, insert_cell, insert_job, insert_job_batch;
    Statement find_attempt, find_options, find_equal_experiments, find_known_result;
    Statement take_job, take_attempt, take_result, take_waypoints, take_unsolved, take_violations;
  };

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
  void InsertWaypoints(std::int64_t job_id, const ResultRecord& result);
  std::int64_t RequeueTimeLimited(const RetryExperiment& op);
  void EndJob(std::int64_t job_id, int attempt, JobState next, bool returned);
  void InsertJobs(const NewExperiment& experiment, std::span<const std::int64_t> problem_keys);
  std::int64_t PutDataset(const DatasetRecord& dataset);
  std::int64_t PutMethod(const MethodRecord& method);
  std::vector<std::int64_t> PutProblems(std::int64_t dataset_id, std::span<const ProblemRecord> problems);
  void RequireOneChange(const char* operation, std::int64_t job_id);
  std::int64_t NextId(const char* kind, const char* table);
  std::vector<std::int64_t> FindEqualExperiments(const ResultSearch& search);
  void LoadSummaries(OpenState& state);
  void LoadDescriptions(std::map<std::int64_t, ExperimentSummary>& by_id);
  void LoadCounts(std::map<std::int64_t, ExperimentSummary>& by_id);
  void LoadOpenJobs(OpenState& state);
  void LoadJobs(std::int64_t first_job_id, std::int64_t num_jobs, Rule rule, OpenExperiment& open);
  void LoadWorkers(OpenState& state);

  bool CheckpointAll();
  std::string Rescue(DatabaseFile::Place place);
  [[noreturn]] void ThrowDisplaced(DatabaseFile::Place place, const std::string& remedy) const;

  void OpenForWriting(const std::filesystem::path& path);

  DatabaseFile file_;  // must outlive the connection
  Connection connection_;
  std::optional<Statements> statements_;  // prepared after migration
  bool written_since_checkpoint_ = false;
  std::filesystem::path rescued_to_;  // path of the rescued copy if the file was unlinked; empty if none was made
};

}  // namespace legopt::db
