#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "db/result_record.h"
#include "legopt/types/collision.h"
#include "legopt/types/job.h"
#include "legopt/types/task.h"

/// Rows of the database as values. Times (`_at_us`) are wall-clock microseconds since 1970; they are informative only,
/// no decision depends on them. Identifiers are positive and chosen by the caller (the scheduler), never by the store.
namespace legopt::db {

using legopt::AttemptOutcome;
using legopt::BuildPolicy;
using legopt::ExperimentHold;
using legopt::ExperimentState;
using legopt::IsTerminal;
using legopt::JobState;

inline constexpr int kMaxPriority = 1000;  ///< largest priority; the smallest is -kMaxPriority

/// Settings of an experiment that change after submission: by the user, and the build by the first worker.
struct ExperimentControl {
  ExperimentHold hold = ExperimentHold::kNone;
  std::string reason;                      ///< reason of the pause; empty if none was given or it is not paused
  int priority = 0;                        ///< experiments with larger numbers are leased first
  BuildPolicy builds = BuildPolicy::kOne;  ///< value as submitted, until a user allows any build
  std::string build_id = {};               ///< build of the worker that took the first job; empty until then

  /// Returns whether workers of this build may run jobs of the experiment.
  bool Admits(const std::string& build) const {
    return builds == BuildPolicy::kAny || build_id.empty() || build_id == build;
  }

  bool operator==(const ExperimentControl&) const = default;
};

struct DatasetRecord {
  std::string name;
  std::string hash;                           ///< 64 lower-case hex digits
  std::vector<std::string> joint_names = {};  ///< joint names of the robot, in the order of a solution; empty if
                                              ///< unknown
};

/// A method as submitted. Methods with equal hashes have equal options; tables show the name.
struct MethodRecord {
  std::string name;
  std::string hash;          ///< 64 lower-case hex digits; hash of the canonical options without the name
  std::string options_json;  ///< canonical options, a JSON object
  int multi_starts = 0;
  int sample_size_percent = 100;
  bool incremental = false;
  SceneRepresentation collision = SceneRepresentation::kSolid;  ///< copy of the value in `options_json`
};

struct ProblemRecord {
  Task task{};
  int number = 0;  ///< problem id in the dataset
  int waypoints = 1;
};

/// A cell of an experiment's benchmark table: all jobs of one method, task and initialization.
struct CellRecord {
  std::int64_t cell_id = 0;
  int method_index = 0;  ///< index into NewExperiment::methods
  Task task{};
  Initialization initialization{};
  std::int64_t num_jobs = 0;
  std::int64_t wall_limit_us = 0;  ///< wall-time limit of a job
  std::int64_t effort_limit = 0;   ///< effort limit of a job in term evaluations; 0: none
};

struct NewJob {
  std::int64_t job_id = 0;
  int cell_index = 0;     ///< index into NewExperiment::cells
  int problem_index = 0;  ///< index into NewExperiment::problems
  int repetition = 0;
};

struct NewExperiment {
  std::int64_t experiment_id = 0;
  std::string submission_id;  ///< unique id chosen by the client
  std::string name;
  std::string spec_json;  ///< canonical text of the spec
  std::string spec_hash;  ///< 64 hex digits; hash of spec_json
  std::string submitter;  ///< up to 200 bytes; may be empty
  BuildPolicy builds = BuildPolicy::kOne;
  Rule rule = Rule::kSolid;  ///< rule that counts its results
  std::int64_t seed = 0;
  int repetitions = 1;
  int max_attempts = 3;
  std::int64_t wall_limit_us = 0;  ///< largest wall-time limit of the cells
  std::int64_t memory_limit_bytes = 0;
  std::int64_t submitted_at_us = 0;
  DatasetRecord dataset;
  std::vector<MethodRecord> methods;    ///< ordered as the table's rows
  std::vector<ProblemRecord> problems;  ///< no duplicates
  std::vector<CellRecord> cells;
  std::vector<NewJob> jobs;  ///< consecutive job ids, in execution order
};

/// A worker process. `endpoint` is its random bus address; a restarted process is a new worker.
struct WorkerRecord {
  std::int64_t worker_id = 0;
  std::int64_t endpoint = 0;
  std::string name;
  std::string hostname;
  std::int64_t pid = 0;
  int slots = 1;
  std::string build;     ///< release, commit, compiler; for display
  std::string build_id;  ///< equal ids imply equal bits; empty for workers recorded before schema version 6
  std::string processor;
  int processors = 1;                                      ///< number of granted processors; 0: unknown
  std::int64_t memory_bytes = 0;                           ///< memory of the host; 0: unknown
  double load = std::numeric_limits<double>::quiet_NaN();  ///< load of the host when last seen
  std::int64_t seen_at_us = 0;
};

inline constexpr std::size_t kMaxNameBytes = 200;
inline constexpr std::size_t kMaxTagBytes = 100;
inline constexpr std::size_t kMaxBuildIdBytes = 64;

/// Returns why the schema would refuse an experiment's name (1 .. kMaxNameBytes bytes without NUL) or a tag (1 ..
/// kMaxTagBytes bytes without NUL and comma); empty if legal.
std::string ValidateName(std::string_view name);
std::string ValidateTag(std::string_view tag);

}  // namespace legopt::db
