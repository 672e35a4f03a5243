#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "client/report/listing.h"
#include "client/report/listing_writer.h"
#include "client/service/server_connection.h"
#include "words/job.h"
#include "words/result.h"
#include "words/split.h"

namespace legopt::client {

/// Where results are read from: a database file (with `db`), else the running server.
struct SourceOptions {
  std::optional<std::string> db;
  NetworkOptions network;
};

/// Read-only SQL over results. Errors: ClientError (see ServerConnection), db::StoreError for files, bus::BusError.
/// A wrong statement is a ClientError with kUsage in both cases.
class ResultSource {
 public:
  virtual ~ResultSource() = default;
  /// Runs one SELECT. Cells as in db::JsonRows; BlobAt reads a BLOB. `limit_s` bounds its time: (0, kLongestLimit_s] at
  /// a server, 0 for none with a file.
  virtual Listing Query(const std::string& sql, int max_rows, double limit_s) = 0;
  Listing Query(const std::string& sql, int max_rows) { return Query(sql, max_rows, kDefaultLimit_s); }
  /// Runs a statement of legopt itself on all rows. Throws db::StoreError with kCorrupt where a file's content makes it
  /// fail, for example text that should be JSON, and ClientError with kCutShort where a limit of rows or bytes would
  /// cut the result: figures are never computed from a part of the rows.
  Listing Query(const std::string& sql);

  /// How much Stream reads.
  struct StreamLimits {
    std::int64_t max_rows = 0;
    double limit_s = kDefaultLimit_s;  ///< 0: none
    bool time_is_per_row = false;      ///< `limit_s` is that of each row
  };
  /// Writes the result of one SELECT row by row, and completes the text also where an error ends it. Only for a file:
  /// a server's answer is one message. True: more rows exist than were written.
  virtual bool Stream(const std::string& sql, const StreamLimits& limits, ListingWriter& writer);

  /// How to name this source in a follow-up command: " --db FILE", or empty for the server.
  virtual std::string flags() const = 0;
  /// Whether it reads a file itself; false: a server answers.
  virtual bool reads_file() const { return false; }

  static constexpr int kAllRows = 1'000'000;
  static constexpr double kDefaultLimit_s = 30;
  static constexpr double kLongestLimit_s = 3600;
};

std::unique_ptr<ResultSource> OpenResults(const SourceOptions& options);

/// The advice of an error about a stored value that cannot be read: whether the file is damaged is not known yet.
inline constexpr std::string_view kCheckDatabase = "'legopt doctor --db FILE' checks the database";

/// The bytes of a BLOB of a query's result; nullopt where the cell is NULL or not a BLOB.
std::optional<std::string> BlobAt(const Listing& listing, std::size_t row, std::string_view column);

/// The float64 values of a BLOB. Throws ClientError (kDatabaseUnusable) that begins with `what` for any other cell.
Eigen::VectorXd WaypointAt(const Listing& listing, std::size_t row, std::string_view column, const std::string& what);

/// The solution of a job: one configuration for each waypoint that is stored. Errors as WaypointAt.
std::vector<Eigen::VectorXd> ReadWaypointsOf(ResultSource& source, std::int64_t job_id);

/// The best point of the window of a motion that was not solved.
struct UnsolvedWaypoints {
  int first_waypoint = 0;                  ///< number of its first waypoint in the motion
  std::vector<Eigen::VectorXd> waypoints;  ///< one configuration each; empty: all windows are solved, or none is stored
};

/// That of a job. Errors as WaypointAt.
UnsolvedWaypoints ReadUnsolvedOf(ResultSource& source, std::int64_t job_id);

/// A text as an SQL literal.
std::string SqlText(const std::string& text);

/// The experiment a command is about: the one asked for, or the newest. Throws ClientError (kUsage) when there is none
/// or no such one.
struct ExperimentInfo {
  std::int64_t id = 0;
  std::string name;
  ExperimentState state{};
  std::string dataset_name;
  std::string dataset_hash;
  Split split = Split::kAll;  ///< which of its problems
  /// Whose success counts: that of its suite; without one solid, and literal where results of an old release have no
  /// verdict by the solid rule.
  Rule rule = Rule::kSolid;
};
ExperimentInfo FindExperiment(ResultSource& source, std::optional<std::int64_t> id);

/// The rule asked for, else the experiment's. Errors as of FindExperiment.
Rule RuleFor(ResultSource& source, std::optional<std::int64_t> experiment, std::optional<Rule> asked);

}  // namespace legopt::client
