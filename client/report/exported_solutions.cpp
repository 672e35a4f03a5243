#include "client/report/exported_solutions.h"

#include <algorithm>
#include <map>
#include <set>

#include "client/client_error.h"
#include "client/report/result_source.h"
#include "db/named_queries.h"
#include "legopt/robot/robot_model.h"
#include "legopt/types/check.h"

namespace legopt::client {
namespace {

constexpr double kSecondsPerMicrosecond = 1e-6;
// Size of a query: a waypoint of Atlas has 576 hexadecimal digits, and a reply of the server may have 48 MiB.
constexpr std::int64_t kWaypointsPerQuery = 20'000;

struct ResultRow {
  std::int64_t job_id = 0;
  ResultKey key;
  Task task{};
  int problem_id = 0;
  double time_s = 0;
  bool success = false;
  std::int64_t num_waypoints = 1;
  std::vector<Eigen::VectorXd> waypoints;
  std::optional<UnsolvedPart> unsolved;
};

std::vector<ResultRow> ReadRows(ResultSource& source, const std::string& sql) {
  const Listing listing = source.Query(sql);
  std::vector<ResultRow> rows;
  for (std::size_t i = 0; i < listing.rows.size(); ++i) {
    const auto integer = [&](const char* column) { return listing.At(i, column).get<std::int64_t>(); };
    rows.push_back({integer("job_id"),
                    {integer("method_id"), listing.Text(i, "method"), integer("multi_starts"), integer("sample_size"),
                     listing.EnumAt<Initialization>(i, "initialization"), integer("repetition"),
                     listing.EnumAt<SceneRepresentation>(i, "collision")},
                    listing.EnumAt<Task>(i, "task"),
                    static_cast<int>(integer("problem_id")),
                    static_cast<double>(integer("solve_us")) * kSecondsPerMicrosecond,
                    listing.EnumAt<Verdict>(i, "verdict_literal") == Verdict::kSuccess,
                    integer("num_waypoints"),
                    {},
                    {}});
  }
  return rows;
}

// A window has few waypoints.
void ReadUnsolved(ResultSource& source, const std::vector<std::int64_t>& jobs,
                  const std::map<std::int64_t, ResultRow*>& by_job) {
  const Listing listing = source.Query(db::Sql(db::Query::kUnsolvedWaypointsOfJobs, {{"job_ids", jobs}}));
  for (std::size_t i = 0; i < listing.rows.size(); ++i) {
    const auto job_id = listing.At(i, "job_id").get<std::int64_t>();
    std::optional<UnsolvedPart>& unsolved = by_job.at(job_id)->unsolved;
    if (!unsolved) unsolved = UnsolvedPart{listing.At(i, "waypoint").get<int>(), {}};
    unsolved->waypoints.push_back(WaypointAt(listing, i, "x", "job " + std::to_string(job_id)));
  }
}

void ReadWaypoints(ResultSource& source, std::vector<ResultRow>* rows) {
  std::map<std::int64_t, ResultRow*> by_job;
  for (auto& row : *rows) by_job[row.job_id] = &row;
  for (std::size_t first = 0; first < rows->size();) {
    std::size_t last = first;
    std::vector<std::int64_t> jobs;
    for (std::int64_t waypoints = 0; last < rows->size() && (last == first || waypoints < kWaypointsPerQuery); ++last) {
      waypoints += (*rows)[last].num_waypoints;
      jobs.push_back((*rows)[last].job_id);
    }
    const Listing listing = source.Query(db::Sql(db::Query::kWaypointsOfJobs, {{"job_ids", jobs}}));
    for (std::size_t i = 0; i < listing.rows.size(); ++i) {
      const auto job_id = listing.At(i, "job_id").get<std::int64_t>();
      by_job.at(job_id)->waypoints.push_back(WaypointAt(listing, i, "x", "job " + std::to_string(job_id)));
    }
    ReadUnsolved(source, jobs, by_job);
    first = last;
  }
}

SolutionFile MakeFile(Task task, const std::vector<ResultRow>& rows, const std::map<std::int64_t, std::string>& methods,
                      const Dataset& dataset) {
  SolutionFile file{dataset.robot().name(), dataset.name(), task, {}, DofNames(dataset.robot())};
  std::map<int, std::vector<Solution>> by_problem;
  for (const auto& row : rows) {
    if (row.task != task) continue;
    Solution& solution = by_problem[row.problem_id].emplace_back();
    solution.method = methods.at(row.job_id);
    solution.time_s = row.time_s;
    solution.waypoints = row.waypoints;
    solution.success = row.success;
    solution.init_type = std::string(ToString(row.key.initialization));
    solution.unsolved = row.unsolved;
  }
  for (auto& [id, solutions] : by_problem) file.problems.push_back({dataset.problem(task, id), std::move(solutions)});
  return file;
}

// Returns true if two of the keys with the same `text` differ in `value`.
template <class Value>
bool Differs(const std::vector<ResultKey>& keys, const std::vector<std::string>& texts, const std::string& text,
             Value value) {
  std::set<decltype(value(keys.front()))> values;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (texts[i] == text) values.insert(value(keys[i]));
  }
  return values.size() > 1;
}

template <class Value, class Suffix>
void Extend(const std::vector<ResultKey>& keys, std::vector<std::string>* texts, Value value, Suffix suffix) {
  const std::vector<std::string> before = *texts;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (Differs(keys, before, before[i], value)) (*texts)[i] += ", " + suffix(keys[i]);
  }
}

}  // namespace

std::vector<std::string> MethodStrings(const std::vector<ResultKey>& keys) {
  std::vector<std::string> texts;
  for (const auto& key : keys) texts.push_back(key.method);
  Extend(
      keys, &texts, [](const ResultKey& k) { return k.multi_starts; },
      [](const ResultKey& k) { return std::to_string(k.multi_starts) + " multi-starts"; });
  Extend(
      keys, &texts, [](const ResultKey& k) { return k.sample_size; },
      [](const ResultKey& k) { return "sample size " + std::to_string(k.sample_size); });
  Extend(
      keys, &texts, [](const ResultKey& k) { return k.collision; },
      [](const ResultKey& k) { return std::string(ToString(k.collision)); });
  Extend(
      keys, &texts, [](const ResultKey& k) { return k.method_id; },
      [](const ResultKey& k) { return "method " + std::to_string(k.method_id); });
  Extend(
      keys, &texts, [](const ResultKey& k) { return k.initialization; },
      [](const ResultKey& k) { return std::string(ToString(k.initialization)); });
  Extend(
      keys, &texts, [](const ResultKey& k) { return k.repetition; },
      [](const ResultKey& k) { return "repetition " + std::to_string(k.repetition); });
  return texts;
}

ExportedSolutions ReadSolutionsOf(ResultSource& source, std::int64_t experiment_id, const Dataset& dataset,
                                  const ResultFilter& filter) {
  const KeptCells kept(source, experiment_id, filter);
  const auto sql = [&](db::Query query) {
    return db::Sql(query, {{"experiment_id", experiment_id}, {"cell_ids", kept.ids()}});
  };
  auto rows = ReadRows(source, sql(db::Query::kExportedResults));
  const Listing count = source.Query(sql(db::Query::kExportedResultCount));
  ReadWaypoints(source, &rows);

  std::vector<ResultKey> keys;
  for (const auto& row : rows) keys.push_back(row.key);
  const auto texts = MethodStrings(keys);
  std::map<std::int64_t, std::string> methods;
  for (std::size_t i = 0; i < rows.size(); ++i) methods[rows[i].job_id] = texts[i];

  std::vector<std::string> origins;
  for (const ResultProvenance& origin : ReadOrigins(source, experiment_id))
    origins.push_back(DescribeOrigins({origin}));
  if (const std::string taken = ReusedResultsSentence(CountReusedResults(source, experiment_id)); !taken.empty()) {
    origins.push_back(taken.substr(1));
  }

  ExportedSolutions exported;
  exported.num_solutions = static_cast<std::int64_t>(rows.size());
  exported.num_missing = count.At(0, "n").get<std::int64_t>() - exported.num_solutions;
  for (const TaskDescription& description : kTasks) {
    auto file = MakeFile(description.task, rows, methods, dataset);
    file.origins = origins;
    if (!file.problems.empty()) exported.files.push_back(std::move(file));
  }
  return exported;
}

}  // namespace legopt::client
