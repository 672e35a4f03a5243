#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// The rows of the database as values. Times are wall-clock microseconds since 1970 (`_at_us`); they inform people and
/// decide nothing. Identifiers are positive and chosen by the caller (the scheduler), never by the store.
namespace legopt::db {

enum class JobState : std::uint8_t {
  kQueued,     ///< waits for a worker
  kLeased,     ///< one running attempt
  kDone,       ///< has its one accepted result, whatever the verdict
  kFailed,     ///< used up its attempts, the last of which reported that the job cannot run (bad problem or option)
  kDead,       ///< used up its attempts otherwise: crashed, expired, over a limit
  kCancelled,  ///< withdrawn by a user
};
inline constexpr int kNumJobStates = 6;

enum class AttemptOutcome : std::uint8_t {
  kRunning,
  kFinished,     ///< gave the accepted result
  kCrashed,      ///< the job child died; `exit_signal` tells how
  kTimeLimit,    ///< killed at its wall-time limit
  kMemoryLimit,  ///< killed at its memory limit
  kError,        ///< the job child reported that it cannot run this job
  kExpired,      ///< the worker was not heard of within the lease
  kCancelled,    ///< the experiment was cancelled
  kReturned,     ///< given back unfinished by a living worker (it shut down, or never got the lease); not charged
};

enum class ExperimentState : std::uint8_t { kActive, kDone, kCancelled };

/// What keeps an active experiment from being worked on.
enum class Hold : std::uint8_t {
  kNone,
  kPaused,  ///< no job is leased
  kHeld,    ///< the same, and what ran was given back; has a reason
};

inline constexpr int kMaxPriority = 1000;  ///< least: -kMaxPriority

/// What people decide about an experiment after its submission.
struct ExperimentControl {
  Hold hold = Hold::kNone;
  std::string reason;  ///< not empty exactly when held
  int priority = 0;    ///< larger: its jobs are leased before others'

  bool operator==(const ExperimentControl&) const = default;
};

/// "queued", "leased", ...; "running", "finished", ...; "active", "done", "cancelled": the values of the columns.
std::string_view ToString(JobState state);
std::string_view ToString(AttemptOutcome outcome);
std::string_view ToString(ExperimentState state);
std::string_view ToString(Hold hold);  ///< "none", "paused", "held"
/// Inverse of ToString; empty when the text names no value.
std::optional<JobState> ParseJobState(std::string_view text);
std::optional<AttemptOutcome> ParseAttemptOutcome(std::string_view text);
std::optional<ExperimentState> ParseExperimentState(std::string_view text);
std::optional<Hold> ParseHold(std::string_view text);

inline constexpr bool IsTerminal(JobState state) { return state != JobState::kQueued && state != JobState::kLeased; }

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
  std::string collision = "solid";  ///< or "surface"; as among the options
};

struct ProblemRecord {
  std::string task;  ///< "posture" or "motion"
  int number = 0;    ///< id of the problem in the dataset
  int waypoints = 1;
};

/// One cell of the benchmark table of an experiment: all jobs of one method, task and initialisation.
struct CellRecord {
  std::int64_t cell_id = 0;
  int method_index = 0;  ///< into NewExperiment::methods
  std::string task;
  std::string initialization;  ///< "good" or "in_collision"
  std::int64_t num_jobs = 0;
  std::int64_t wall_limit_us = 0;  ///< of one job
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
  std::string build;
  std::int64_t seen_at_us = 0;
};

/// What a worker reports of a finished attempt: the solver's word, and beside it the judge's.
/// Floating-point fields that are not finite mean "not available" and become NULL.
struct ResultRecord {
  std::string solver_status;
  int iterations = 0;
  int restarts = 0;
  std::int64_t wall_us = 0;  ///< of the solve, restarts included, loading excluded
  std::int64_t cpu_us = 0;
  std::int64_t involuntary_context_switches = 0;
  std::int64_t peak_memory_bytes = 0;
  double solver_cost = 0;
  double solver_violation = 0;
  std::string verdict_literal;
  std::string verdict_strict;
  std::string verdict_detail;
  int failed_waypoint = -1;  ///< -1: none
  double cost = 0;           ///< per waypoint, by the judge; finite when the literal verdict is "success"
  double foot_violation = 0;
  double com_violation_m = 0;
  double limit_violation = 0;
  double environment_depth_m = 0;
  double self_depth_literal_m = 0;
  double self_depth_strict_m = 0;
  // Between consecutive waypoints of a motion, see legopt/evaluate/interpolation.h; not finite for postures.
  double interpolation_environment_depth_m = std::numeric_limits<double>::quiet_NaN();
  double interpolation_self_depth_m = std::numeric_limits<double>::quiet_NaN();
  double interpolation_free_share = std::numeric_limits<double>::quiet_NaN();  ///< of the transitions, 0 .. 1
  int windows = 0;         ///< that the motion was cut into; 0: not solved by windows
  int windows_solved = 0;  ///< 0 .. windows
  int num_waypoints =
      1;  ///< divisor of cost and time (constraint waypoints of the problem), not the rows of `waypoints`
  std::string history_json;
  int waypoint_size = 0;          ///< numbers per waypoint, n + 7
  std::vector<double> waypoints;  ///< row by row; a multiple of waypoint_size, may be empty
};

inline constexpr std::string_view kSuccess = "success";

inline constexpr std::string_view kSolverTimeLimit =
    "time_limit";  ///< `solver_status` of a solve that the clock stopped

inline constexpr std::size_t kMaxNameBytes = 200;
inline constexpr std::size_t kMaxTagBytes = 100;

/// Why the schema would refuse this as an experiment's name (1 .. kMaxNameBytes bytes without NUL) or tag (1 ..
/// kMaxTagBytes bytes without NUL and comma); empty when it is legal.
std::string FaultOfName(std::string_view name);
std::string FaultOfTag(std::string_view tag);

/// Why the schema would refuse the result (an unknown status or verdict, a negative count, a success without cost);
/// empty when it is legal. Whoever takes results from others asks before storing.
std::string FaultOf(const ResultRecord& result);

}  // namespace legopt::db
