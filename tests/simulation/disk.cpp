#include "tests/simulation/disk.h"

#include "db/audit.h"
#include "db/read_only_database.h"
#include "db/sqlite_store.h"

namespace legopt::simulation {
namespace {

std::int64_t IntOf(const db::Value& value) { return std::get<std::int64_t>(value); }
const std::string& TextOf(const db::Value& value) { return std::get<std::string>(value); }

template <NamedEnum Enum>
Enum EnumNameOf(const db::Value& value) {
  return ParseEnum<Enum>(TextOf(value)).value();
}

}  // namespace

StoredState MemoryDisk::Read() {
  StoredState state;
  for (const db::ExperimentSummary& summary : store_.LoadOpenState().experiments) {
    state.experiments[summary.experiment_id] = {summary.submission_id, summary.state, summary.first_job_id,
                                                summary.num_jobs};
    const db::OpenExperiment open = store_.LoadExperiment(summary.experiment_id).value();
    for (std::int64_t id = summary.first_job_id; id < summary.first_job_id + summary.num_jobs; ++id) {
      StoredState::Job& job = state.jobs[id];
      job.experiment_id = summary.experiment_id;
      job.state = store_.job_state(id).value();
      job.attempts = store_.num_attempts(id);
      job.returned = open.jobs.at(static_cast<std::size_t>(id - summary.first_job_id)).returned;
      if (const auto result = store_.accepted_result(id)) {
        job.accepted = result->attempt;
        job.cost = result->result.cost;
        job.taken_from = store_.taken_from(id);
      }
      for (int attempt = 1; attempt <= job.attempts; ++attempt) {
        state.attempts[{id, attempt}] = store_.FindAttempt(id, attempt).value();
        if (store_.has_stale(id, attempt)) state.stale.insert({id, attempt});
      }
    }
  }
  return state;
}

db::Store& SqliteDisk::Open() {
  store_ = db::OpenSqliteStore(folder_ / "results.sqlite");
  return *store_;
}

StoredState SqliteDisk::Read() {
  StoredState state;
  db::ReadOnlyDatabase database(folder_ / "results.sqlite");
  for (const auto& row :
       database.Query("SELECT experiment_id, submission_id, state, first_job_id, num_jobs FROM experiments").rows) {
    state.experiments[IntOf(row[0])] = {TextOf(row[1]), EnumNameOf<ExperimentState>(row[2]), IntOf(row[3]),
                                        IntOf(row[4])};
  }
  for (const auto& row :
       database
           .Query("SELECT j.job_id, c.experiment_id, j.state, j.attempts, r.attempt, r.cost, j.returned, "
                  "coalesce(j.taken_from, 0) "
                  "FROM jobs AS j JOIN cells AS c USING (cell_id) LEFT JOIN results AS r "
                  "ON r.job_id = j.job_id")
           .rows) {
    StoredState::Job& job = state.jobs[IntOf(row[0])];
    job.experiment_id = IntOf(row[1]);
    job.state = EnumNameOf<JobState>(row[2]);
    job.attempts = static_cast<int>(IntOf(row[3]));
    job.returned = static_cast<int>(IntOf(row[6]));
    job.taken_from = IntOf(row[7]);
    if (std::holds_alternative<std::int64_t>(row[4])) {
      job.accepted = static_cast<int>(IntOf(row[4]));
      job.cost = std::get<double>(row[5]);
    }
  }
  for (const auto& row : database
                             .Query("SELECT a.job_id, a.attempt, a.token, a.worker_id, a.outcome, j.state "
                                    "FROM attempts AS a JOIN jobs AS j USING (job_id)")
                             .rows) {
    state.attempts[{IntOf(row[0]), static_cast<int>(IntOf(row[1]))}] = {
        IntOf(row[2]), IntOf(row[3]), EnumNameOf<AttemptOutcome>(row[4]), EnumNameOf<JobState>(row[5])};
  }
  for (const auto& row : database.Query("SELECT job_id, attempt FROM stale_results").rows) {
    state.stale.insert({IntOf(row[0]), static_cast<int>(IntOf(row[1]))});
  }
  return state;
}

std::string SqliteDisk::Examine() {
  std::string faults;
  for (const db::AuditDiagnostic& defect : db::Audit(folder_ / "results.sqlite")) {
    if (defect.rule == "times_are_in_order") continue;  // some histories set the wall clock back
    faults += (faults.empty() ? "" : "; ") + defect.rule + ": " + defect.detail;
  }
  return faults;
}

}  // namespace legopt::simulation
