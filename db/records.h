#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "db/result_record.h"
#include "words/collision.h"
#include "words/job.h"
#include "words/task.h"

/// The rows of the database as values. Times are wall-clock microseconds since 1970 (`_at_us`); they inform people and
/// decide nothing. Identifiers are positive and chosen by the caller (the scheduler), never by the store.
namespace legopt::db {

using legopt::AttemptOutcome;
using legopt::BuildRule;
using legopt::ExperimentState;
using legopt::Hold;
using legopt::IsTerminal;
using legopt::JobState;

inline constexpr int kMaxPriority = 1000;  ///< least: -kMaxPriority

/// What is decided about an experiment after its submission: by people, and the build by the first worker.
struct ExperimentControl {
  Hold hold = Hold::kNone;
  std::string reason;                  ///< not empty exactly when held
  int priority = 0;                    ///< larger: its jobs are leased before others'
  BuildRule builds = BuildRule::kOne;  ///< as submitted, until somebody lets any build finish it
  std::string build_id = {};           ///< of the worker that took the first job; empty: nobody has

  /// Whether workers of this build get jobs of it.
  bool Admits(const std::string& build) const {
    return builds == BuildRule::kAny || build_id.empty() || build_id == build;
  }

  bool operator==(const ExperimentControl&) const = default;
};

struct DatasetRecord {
  std::string name;
  std::string hash;                           ///< 64 lower-case hex digits
  std::vector<std::string> joint_names = {};  ///< of its robot, in the order of a solution; empty: not told
};

/// A method as submitted. Equal hash means equal options; the name is what tables show.
struct MethodRecord {
  std::string name;
  std::string hash;          ///< 64 lower-case hex digits, of the canonical options without the name
  std::string options_json;  ///< canonical options, a JSON object
  int multi_starts = 0;
  int sample_size_percent = 100;
  bool incremental = false;
  SceneRepresentation collision = SceneRepresentation::kSolid;  ///< as among the options
};

struct ProblemRecord {
  Task task{};
  int number = 0;  ///< id of the problem in the dataset
  int waypoints = 1;
};

/// One cell of the benchmark table of an experiment: all jobs of one method, task and initialisation.
struct CellRecord {
  std::int64_t cell_id = 0;
  int method_index = 0;  ///< into NewExperiment::methods
  Task task{};
  Initialization initialization{};
  std::int64_t num_jobs = 0;
  std::int64_t wall_limit_us = 0;  ///< of one job
  std::int64_t effort_limit = 0;   ///< of one job, in term evaluations; 0: none
};

struct NewJob {
  std::int64_t job_id = 0;
  int cell_index = 0;     ///< into NewExperiment::cells
  int problem_index = 0;  ///< into NewExperiment::problems
  int repetition = 0;
};

struct NewExperiment {
  std::int64_t experiment_id = 0;
  std::string submission_id;  ///< made by the client; unique
  std::string name;
  std::string spec_json;  ///< canonical text of the spec
  std::string spec_hash;  ///< 64 hex digits, of spec_json
  std::string submitter;  ///< at most 200 bytes; may be empty
  BuildRule builds = BuildRule::kOne;
  Rule rule = Rule::kSolid;  ///< rule by which its results are counted
  std::int64_t seed = 0;
  int repetitions = 1;
  int max_attempts = 3;
  std::int64_t wall_limit_us = 0;  ///< the largest of the cells'
  std::int64_t memory_limit_bytes = 0;
  std::int64_t submitted_at_us = 0;
  DatasetRecord dataset;
  std::vector<MethodRecord> methods;    ///< in the order of the table's rows
  std::vector<ProblemRecord> problems;  ///< no duplicates
  std::vector<CellRecord> cells;
  std::vector<NewJob> jobs;  ///< consecutive job ids, in the order of work
};

/// A worker process. `endpoint` is its random address on the bus: a restarted process is another worker.
struct WorkerRecord {
  std::int64_t worker_id = 0;
  std::int64_t endpoint = 0;
  std::string name;
  std::string hostname;
  std::int64_t pid = 0;
  int slots = 1;
  std::string build;     ///< for people: release, commit, compiler
  std::string build_id;  ///< equal: the same bits; empty: told by none, before schema version 6
  std::string processor;
  int processors = 1;                                      ///< granted
  std::int64_t memory_bytes = 0;                           ///< of the host; 0: unknown
  double load = std::numeric_limits<double>::quiet_NaN();  ///< of the host, at the last sighting
  std::int64_t seen_at_us = 0;
};

inline constexpr std::size_t kMaxNameBytes = 200;
inline constexpr std::size_t kMaxTagBytes = 100;
inline constexpr std::size_t kMaxBuildIdBytes = 64;

/// Why the schema would refuse this as an experiment's name (1 .. kMaxNameBytes bytes without NUL) or tag (1 ..
/// kMaxTagBytes bytes without NUL and comma); empty when it is legal.
std::string FaultOfName(std::string_view name);
std::string FaultOfTag(std::string_view tag);

}  // namespace legopt::db
