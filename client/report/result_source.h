#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "client/report/listing.h"
#include "client/service/server_connection.h"
#include "legopt/types/check.h"
#include "legopt/types/experiment.h"
#include "legopt/types/job.h"

namespace legopt::client {

/// Source of results: a database file (with `db`), else the running server.
struct SourceOptions {
  std::optional<std::string> db;
  NetworkOptions network;
  /// Receives a sentence before 50,000 jobs or more are read, which takes seconds; may be empty.
  std::function<void(const std::string&)> announce = {};
};

/// Read-only SQL over results. Throws ClientError (see ServerConnection), db::StoreError for files, bus::BusError. An
/// invalid statement is a ClientError with kUsage in both cases.
class ResultSource {
 public:
  virtual ~ResultSource() = default;
  /// Runs one SELECT. Cells are as in db::JsonRows; BlobAt reads a BLOB. `limit_s` is the time limit: (0,
  /// kLongestLimit_s] for a server; 0 means no limit for a file.
  virtual Listing Query(const std::string& sql, int max_rows, double limit_s) = 0;
  Listing Query(const std::string& sql, int max_rows) { return Query(sql, max_rows, kDefaultLimit_s); }
  /// Runs one of legopt's own statements on all rows. Throws db::StoreError with kCorrupt if a file's contents make it
  /// fail, for example text that should be JSON, and ClientError with kCutShort if a limit of rows or bytes would cut
  /// the result: figures are never computed from a part of the rows.
  Listing Query(const std::string& sql);

  /// Limits of Stream.
  struct StreamLimits {
    std::int64_t max_rows = 0;
    double limit_s = kDefaultLimit_s;  ///< 0: no limit
    bool time_is_per_row = false;      ///< apply `limit_s` to each row
  };
  /// Writes the result of one SELECT row by row, and completes the text even after an error. Only for a file, because a
  /// server's answer is a single message. Returns true if more rows exist than were written.
  virtual bool Stream(const std::string& sql, const StreamLimits& limits, ListingWriter& writer);

  /// Arguments that select this source in another command: " --db FILE", or empty for the server.
  virtual std::string flags() const = 0;
  /// Whether it reads a file itself; false: a server answers.
  virtual bool reads_file() const { return false; }

  void set_announce(std::function<void(const std::string&)> announce) { announce_ = std::move(announce); }
  /// Announces that these jobs of an experiment are read, if they are 50,000 or more and it was not announced before.
  void AnnounceJobs(std::int64_t jobs, std::int64_t experiment_id);

  static constexpr int kAllRows = 1'000'000;
  static constexpr double kDefaultLimit_s = 30;
  static constexpr double kLongestLimit_s = 3600;

 private:
  std::function<void(const std::string&)> announce_;
  std::set<std::int64_t> announced_;  ///< experiments
};

std::unique_ptr<ResultSource> OpenResults(const SourceOptions& options);

/// Advice in errors about unreadable stored values: it is not yet known whether the file is damaged.
inline constexpr std::string_view kCheckDatabase = "'legopt service doctor --db FILE' checks the database";

/// Returns the bytes of a BLOB in a query's result; nullopt if the cell is NULL or not a BLOB.
std::optional<std::string> BlobAt(const Listing& listing, std::size_t row, std::string_view column);

/// Returns the float64 values of a BLOB. Throws ClientError (kDatabaseUnusable) with a message that begins with `what`
/// for any other cell.
Eigen::VectorXd WaypointAt(const Listing& listing, std::size_t row, std::string_view column, const std::string& what);

/// Returns the solution of a job: one configuration per stored waypoint. Throws the errors of WaypointAt.
std::vector<Eigen::VectorXd> ReadWaypointsOf(ResultSource& source, std::int64_t job_id);

/// The best point of the unsolved window of a motion.
struct UnsolvedWaypoints {
  int first_waypoint = 0;                  ///< index of its first waypoint in the motion
  std::vector<Eigen::VectorXd> waypoints;  ///< one configuration per waypoint; empty if all windows are solved, or none
                                           ///< is stored
};

/// Reads the unsolved window of a job. Throws the errors of WaypointAt.
UnsolvedWaypoints ReadUnsolvedOf(ResultSource& source, std::int64_t job_id);

/// The experiment of a command.
struct ExperimentInfo {
  std::int64_t id = 0;
  std::string name;
  ExperimentState state{};
  std::string dataset_name;
  std::string dataset_hash;
  std::int64_t num_jobs = 0;
  Split split = Split::kAll;  ///< subset of its problems
  /// Rule that counts successes: the rule of its suite; by default the solid rule, or the original evaluator's rule
  /// if results of an old release have no verdict by the solid rule.
  Rule rule = Rule::kSolid;
};
/// Returns false for a database to which no experiment was submitted.
bool HasExperiments(ResultSource& source);

/// Returns the experiment with this id, or the newest without one. Throws ClientError (kUsage) if it does not exist.
ExperimentInfo FindExperiment(ResultSource& source, std::optional<std::int64_t> id);

/// Returns `asked` if set, else the experiment's rule. Throws the errors of FindExperiment.
Rule RuleFor(ResultSource& source, std::optional<std::int64_t> experiment, std::optional<Rule> asked);

/// A build on a kind of machine, and the number of accepted results of an experiment that it made. Unknown values are
/// empty or nullopt.
struct ResultProvenance {
  std::string build_id;  ///< equal ids imply equal bits
  std::string build;     ///< release, commit, compiler
  std::string hostname;
  std::string processor;
  std::optional<std::int64_t> processors;    ///< maximum number granted to a worker
  std::optional<std::int64_t> memory_bytes;  ///< memory of the host
  std::optional<double> load;                ///< largest load of the host when a worker was last seen
  std::int64_t workers = 0;
  std::int64_t results = 0;

  bool operator==(const ResultProvenance&) const = default;
};

/// Reads the origins of an experiment's results, most results first.
std::vector<ResultProvenance> ReadOrigins(ResultSource& source, std::int64_t experiment_id);

/// Returns a sentence for captions, empty without origins: "Build 0f3c... (legopt 0.1.0 (8a643da59c), GNU 12.2.0) on
/// AMD EPYC, 2 processors, 24 GiB, load 1.8." Lists several builds or machines.
std::string DescribeOrigins(const std::vector<ResultProvenance>& origins);

/// Returns the number of results that an experiment reused from other experiments.
std::int64_t CountReusedResults(ResultSource& source, std::int64_t experiment_id);

/// Returns a sentence to be appended to the origins, with a leading space: " 40 results were taken over from other
/// experiments." Empty if there are none.
std::string ReusedResultsSentence(std::int64_t results);

nlohmann::ordered_json OriginsJson(const std::vector<ResultProvenance>& origins);

/// Returns the distinct build ids, separated by spaces.
std::string BuildIds(const std::vector<ResultProvenance>& origins);

/// Returns the attempts of a job in order: attempt, outcome, worker, hostname, build, processor, exit_signal, seconds,
/// leased_utc, message, log_tail (last lines written by its process).
Listing ReadAttempts(ResultSource& source, std::int64_t job_id);

}  // namespace legopt::client
