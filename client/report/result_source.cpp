#include "client/report/result_source.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "client/client_error.h"
#include "db/named_queries.h"
#include "db/query_json.h"
#include "db/read_only_database.h"
#include "db/store_error.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

Listing ListingOf(db::JsonRows result) { return {std::move(result.columns), std::move(result.rows), result.truncated}; }

// Converts rows of a database to rows of a listing.
class WriterSink final : public db::RowSink {
 public:
  explicit WriterSink(ListingWriter& writer) : writer_(writer) {}
  void Begin(const std::vector<std::string>& columns) override {
    row_.columns = columns;
    writer_.Begin(db::ToJsonRows(row_).columns);
  }
  void Row(std::vector<db::Value> row) override {
    row_.rows = {std::move(row)};
    writer_.Row(db::ToJsonRows(row_).rows.front());
  }

 private:
  ListingWriter& writer_;
  db::QueryResult row_;
};

class FileSource final : public ResultSource {
 public:
  explicit FileSource(const std::string& file) : file_(file), database_(file) {}

  using ResultSource::Query;
  Listing Query(const std::string& sql, int max_rows, double limit_s) override {
    db::QueryLimits limits;
    limits.max_rows = max_rows;
    limits.time_limit = std::chrono::milliseconds(std::llround(limit_s * 1e3));
    return ListingOf(db::ToJsonRows(database_.Query(sql, {}, limits)));
  }

  bool Stream(const std::string& sql, const StreamLimits& stream_limits, ListingWriter& writer) override {
    db::QueryLimits limits;
    limits.max_rows = stream_limits.max_rows;
    limits.time_limit = std::chrono::milliseconds(std::llround(stream_limits.limit_s * 1e3));
    limits.time_is_per_row = stream_limits.time_is_per_row;
    WriterSink sink(writer);
    try {
      const bool truncated = database_.Stream(sql, limits, sink);
      writer.End();
      return truncated;
    } catch (const db::StoreError&) {
      writer.End();
      throw;
    }
  }

  std::string flags() const override { return " --db " + file_; }
  bool reads_file() const override { return true; }

 private:
  std::string file_;
  db::ReadOnlyDatabase database_;
};

class ServerSource final : public ResultSource {
 public:
  explicit ServerSource(const NetworkOptions& options) : options_(options), server_(options) {}

  using ResultSource::Query;
  Listing Query(const std::string& sql, int max_rows, double limit_s) override {
    auto result = db::ReadJsonRows(server_.Query(sql, max_rows, limit_s));
    if (!result) throw ClientError(ExitCode::kInternal, "the server's query result is not understood");
    return ListingOf(std::move(*result));
  }

  std::string flags() const override {
    return options_.port ? " --port " + std::to_string(*options_.port) : std::string();
  }

 private:
  NetworkOptions options_;
  ServerConnection server_;
};

[[noreturn]] void ThrowCut(std::size_t rows, bool of_file) {
  std::string limit = std::to_string(ResultSource::kAllRows) + " rows that one query may read";
  if (rows < static_cast<std::size_t>(ResultSource::kAllRows)) {
    limit = of_file ? "256 MiB that a result may take in memory" : "48 MiB of a server's answer";
  }
  throw ClientError(ExitCode::kCutShort,
                    "the data of this experiment exceed the " + limit + ", so nothing is computed from them; " +
                        (of_file ? "read them with 'legopt query --format csv', which has no limit, or ask for a part"
                                 : "read the server's database file with --db, or ask for a part"));
}

}  // namespace

std::unique_ptr<ResultSource> OpenResults(const SourceOptions& options) {
  std::unique_ptr<ResultSource> source;
  if (options.db) {
    source = std::make_unique<FileSource>(*options.db);
  } else {
    source = std::make_unique<ServerSource>(options.network);
  }
  source->set_announce(options.announce);
  return source;
}

void ResultSource::AnnounceJobs(std::int64_t jobs, std::int64_t experiment_id) {
  constexpr std::int64_t kMany = 50'000;
  if (jobs < kMany || !announce_ || !announced_.insert(experiment_id).second) return;
  announce_("reads " + std::to_string(jobs) + " jobs of experiment " + std::to_string(experiment_id) +
            "; --methods, --tasks and --initializations select fewer");
}

Listing ResultSource::Query(const std::string& sql) {
  try {
    Listing listing = Query(sql, kAllRows);
    if (listing.truncated) ThrowCut(listing.rows.size(), reads_file());
    return listing;
  } catch (const db::StoreError& error) {
    if (error.code() != db::StoreErrorCode::kBadQuery) throw;
    const std::string what = error.what();
    throw db::StoreError(db::StoreErrorCode::kCorrupt,
                         what.substr(0, what.rfind("; ")) +
                             "; the file is damaged: restore a backup, 'legopt service restore BACKUP --db FILE'");
  }
}

bool ResultSource::Stream(const std::string& /*sql*/, const StreamLimits& /*limits*/, ListingWriter& /*writer*/) {
  throw std::logic_error("a server's answer is not read row by row");
}

std::optional<std::string> BlobAt(const Listing& listing, std::size_t row, std::string_view column) {
  const auto& cell = listing.At(row, column);
  return cell.is_string() ? db::ParseBlobText(cell.get_ref<const std::string&>()) : std::nullopt;
}

Eigen::VectorXd WaypointAt(const Listing& listing, std::size_t row, std::string_view column, const std::string& what) {
  static_assert(std::endian::native == std::endian::little);
  const auto bytes = BlobAt(listing, row, column);
  if (!bytes || bytes->size() % sizeof(double) != 0) {
    const std::string found = bytes ? "holds " + std::to_string(bytes->size()) + " bytes" : "holds no BLOB";
    throw ClientError(ExitCode::kDatabaseUnusable,
                      what + ": " + found + " instead of an array of float64; " + std::string(kCheckDatabase));
  }
  Eigen::VectorXd x(static_cast<Eigen::Index>(bytes->size() / sizeof(double)));
  std::memcpy(x.data(), bytes->data(), bytes->size());
  return x;
}

std::vector<Eigen::VectorXd> ReadWaypointsOf(ResultSource& source, std::int64_t job_id) {
  const std::string job = std::to_string(job_id);
  const Listing rows = source.Query(db::Sql(db::Query::kWaypointsOfJobs, {{"job_ids", job_id}}));
  std::vector<Eigen::VectorXd> waypoints;
  for (std::size_t i = 0; i < rows.rows.size(); ++i) {
    waypoints.push_back(WaypointAt(rows, i, "x", "job " + job + ", waypoint " + std::to_string(i)));
  }
  return waypoints;
}

UnsolvedWaypoints ReadUnsolvedOf(ResultSource& source, std::int64_t job_id) {
  const std::string job = std::to_string(job_id);
  const Listing rows = source.Query(db::Sql(db::Query::kUnsolvedWaypointsOfJobs, {{"job_ids", job_id}}));
  UnsolvedWaypoints unsolved;
  for (std::size_t i = 0; i < rows.rows.size(); ++i) {
    if (i == 0) unsolved.first_waypoint = rows.At(i, "waypoint").get<int>();
    unsolved.waypoints.push_back(WaypointAt(rows, i, "x", "job " + job + ", unsolved waypoint " + std::to_string(i)));
  }
  return unsolved;
}

bool HasExperiments(ResultSource& source) {
  return source.Query(db::Sql(db::Query::kExperimentCount)).At(0, "n").get<std::int64_t>() > 0;
}

ExperimentInfo FindExperiment(ResultSource& source, std::optional<std::int64_t> id) {
  const Listing found = source.Query(db::Sql(db::Query::kExperiment, {{"experiment_id", id}}));
  if (found.rows.empty()) {
    throw ClientError(ExitCode::kUsage, id ? "there is no experiment " + std::to_string(*id) + "; 'legopt status" +
                                                 source.flags() + "' lists them"
                                           : "there is no experiment yet; submit one with 'legopt submit SUITE'");
  }
  return {found.At(0, "experiment_id").get<std::int64_t>(),
          found.At(0, "name").get<std::string>(),
          found.EnumAt<ExperimentState>(0, "state"),
          found.At(0, "dataset").get<std::string>(),
          found.At(0, "hash").get<std::string>(),
          found.At(0, "num_jobs").get<std::int64_t>(),
          found.EnumAt<Split>(0, "split"),
          found.EnumAt<Rule>(0, "rule")};
}

Rule RuleFor(ResultSource& source, std::optional<std::int64_t> experiment, std::optional<Rule> asked) {
  return asked ? *asked : FindExperiment(source, experiment).rule;
}

namespace {

constexpr double kGibibyte = 1 << 30;

std::optional<std::int64_t> OptionalInteger(const nlohmann::json& value) {
  return value.is_number_integer() ? std::optional(value.get<std::int64_t>()) : std::nullopt;
}

// Returns the distinct texts, in the order of their first occurrence.
std::vector<std::string> Distinct(const std::vector<ResultProvenance>& origins,
                                  std::string (*text)(const ResultProvenance&)) {
  std::vector<std::string> distinct;
  for (const ResultProvenance& origin : origins) {
    const std::string mine = text(origin);
    if (std::find(distinct.begin(), distinct.end(), mine) == distinct.end()) distinct.push_back(mine);
  }
  return distinct;
}

std::string Joined(const std::vector<std::string>& texts, const char* between) {
  std::string joined;
  for (const std::string& text : texts) joined += (joined.empty() ? "" : between) + text;
  return joined;
}

std::string IdOf(const ResultProvenance& origin) { return origin.build_id.empty() ? "unknown" : origin.build_id; }

std::string BuildOf(const ResultProvenance& origin) { return IdOf(origin) + " (" + origin.build + ")"; }

std::string MachineOf(const ResultProvenance& origin) {
  std::string text = origin.processor.empty() ? "a machine that is not known" : origin.processor;
  if (origin.processors) {
    text += ", " + std::to_string(*origin.processors) + (*origin.processors == 1 ? " processor" : " processors");
  }
  if (origin.memory_bytes) {
    text += ", " + std::to_string(std::lround(static_cast<double>(*origin.memory_bytes) / kGibibyte)) + " GiB";
  }
  if (origin.load) text += ", load " + FormatFixed(*origin.load, 1);
  return text;
}

}  // namespace

std::vector<ResultProvenance> ReadOrigins(ResultSource& source, std::int64_t experiment_id) {
  const Listing listing =
      source.Query(db::Sql(db::Query::kResultOriginsOfExperiment, {{"experiment_id", experiment_id}}));
  std::vector<ResultProvenance> origins;
  for (std::size_t i = 0; i < listing.rows.size(); ++i) {
    const nlohmann::json& load = listing.At(i, "load");
    origins.push_back({listing.Text(i, "build_id"), listing.Text(i, "build"), listing.Text(i, "hostname"),
                       listing.Text(i, "processor"), OptionalInteger(listing.At(i, "processors")),
                       OptionalInteger(listing.At(i, "memory_bytes")),
                       load.is_number() ? std::optional(load.get<double>()) : std::nullopt,
                       listing.At(i, "workers").get<std::int64_t>(), listing.At(i, "results").get<std::int64_t>()});
  }
  return origins;
}

std::string DescribeOrigins(const std::vector<ResultProvenance>& origins) {
  if (origins.empty()) return {};
  const std::vector<std::string> builds = Distinct(origins, BuildOf);
  const std::string many = builds.size() == 1 ? "Build " : std::to_string(builds.size()) + " builds: ";
  return many + Joined(builds, ", ") + " on " + Joined(Distinct(origins, MachineOf), "; ") + ".";
}

std::int64_t CountReusedResults(ResultSource& source, std::int64_t experiment_id) {
  return source.Query(db::Sql(db::Query::kReusedResultCount, {{"experiment_id", experiment_id}}))
      .At(0, "n")
      .get<std::int64_t>();
}

std::string ReusedResultsSentence(std::int64_t results) {
  if (results == 0) return {};
  return " " + std::to_string(results) + (results == 1 ? " result was" : " results were") +
         " reused from other experiments.";
}

nlohmann::ordered_json OriginsJson(const std::vector<ResultProvenance>& origins) {
  const auto optional = [](const auto& value) {
    return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json();
  };
  auto json = nlohmann::ordered_json::array();
  for (const ResultProvenance& origin : origins) {
    json.push_back({{"build_id", origin.build_id},
                    {"build", origin.build},
                    {"hostname", origin.hostname},
                    {"processor", origin.processor},
                    {"processors", optional(origin.processors)},
                    {"memory_bytes", optional(origin.memory_bytes)},
                    {"load", optional(origin.load)},
                    {"workers", origin.workers},
                    {"results", origin.results}});
  }
  return json;
}

std::string BuildIds(const std::vector<ResultProvenance>& origins) { return Joined(Distinct(origins, IdOf), " "); }

Listing ReadAttempts(ResultSource& source, std::int64_t job_id) {
  return source.Query(db::Sql(db::Query::kAttemptsOfJob, {{"job_id", job_id}}));
}

}  // namespace legopt::client
