#include "client/archive/archive_pack.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "client/client_error.h"
#include "client/suite/yaml_map.h"
#include "db/named_queries.h"
#include "legopt/input/json.h"
#include "legopt/input/yaml.h"

namespace legopt::client {
namespace {

// Reads tasks, initializations, repetitions and seed from the specification that the server accepted.
void ReadSpec(ResultSource& source, std::int64_t experiment_id, Archive* archive) {
  const Listing row = source.Query(db::Sql(db::Query::kArchivedExperiment, {{"experiment_id", experiment_id}}));
  const std::string place = "experiment " + std::to_string(experiment_id) + ": spec_json";
  try {
    const nlohmann::json spec = ParseJson(row.At(0, "spec_json").get<std::string>(), place);
    archive->seed = spec.at("seed").get<std::int64_t>();
    archive->repetitions = spec.at("repetitions").get<int>();
    for (const nlohmann::json& task : spec.at("tasks")) {
      ArchivedTask& made = archive->tasks.emplace_back();
      made.task = ParseEnum<Task>(task.at("task").get<std::string>()).value();
      made.problems = task.at("problems").get<std::vector<int>>();
      std::sort(made.problems.begin(), made.problems.end());
    }
    for (const nlohmann::json& word : spec.at("initializations")) {
      archive->initializations.push_back(ParseEnum<Initialization>(word.get<std::string>()).value());
    }
  } catch (const std::exception&) {  // a damaged row
    throw ClientError(ExitCode::kDatabaseUnusable, place + " is damaged; " + std::string(kCheckDatabase));
  }
}

// Returns the index of the build in the archive, which is added if it is new.
std::size_t BuildAt(const Listing& rows, std::size_t row, Archive* archive) {
  const ArchivedBuild build{rows.Text(row, "build_id"), rows.Text(row, "build"), rows.Text(row, "processor")};
  if (build.id.empty()) {
    throw ClientError(ExitCode::kUsage, "job " + rows.Text(row, "job_id") +
                                            " was solved by a build that reported no id, so its result cannot be "
                                            "reproduced; solve the experiment with this release ('--again')");
  }
  const auto same = [&](const ArchivedBuild& other) {
    return other.id == build.id && other.text == build.text && other.processor == build.processor;
  };
  const auto found = std::ranges::find_if(archive->builds, same);
  if (found != archive->builds.end()) return static_cast<std::size_t>(found - archive->builds.begin());
  archive->builds.push_back(build);
  return archive->builds.size() - 1;
}

ArchivedResult ResultAt(const Listing& rows, std::size_t row) {
  ArchivedResult result;
  result.task = rows.EnumAt<Task>(row, "task");
  result.initialization = rows.EnumAt<Initialization>(row, "initialization");
  result.problem = rows.At(row, "problem_id").get<int>();
  result.repetition = rows.At(row, "repetition").get<int>();
  result.status = rows.EnumAt<SolveStatus>(row, "solver_status");
  result.cpu_us = std::max<std::int64_t>(rows.At(row, "cpu_us").get<std::int64_t>(), 1);
  result.work_ns = rows.At(row, "work_ns").get<std::int64_t>();
  result.evaluations = rows.At(row, "term_evaluations").get<std::int64_t>();
  result.collision_queries = rows.At(row, "collision_queries").get<std::int64_t>();
  result.iterations = rows.At(row, "iterations").get<std::int64_t>();
  result.restarts = rows.At(row, "restarts").get<std::int64_t>();
  result.windows = rows.At(row, "windows").get<std::int64_t>();
  result.windows_solved = rows.At(row, "windows_solved").get<std::int64_t>();
  if (!rows.At(row, "window_verdict").is_null()) result.window_verdict = rows.EnumAt<Verdict>(row, "window_verdict");
  result.starts = rows.At(row, "starts").get<std::int64_t>();
  result.margin_relaxed = rows.At(row, "margin_relaxed").get<double>();
  for (const auto& [rule, word] : kEnumNames<Rule>) {
    const std::string column = "verdict_" + std::string(word);
    if (!rows.At(row, column).is_null()) result.verdicts[rule] = rows.EnumAt<Verdict>(row, column);
  }
  const auto number = [&](const char* column) -> std::optional<double> {
    const auto& value = rows.At(row, column);
    return value.is_null() ? std::nullopt : std::optional(value.get<double>());
  };
  result.solver_cost = number("solver_cost");
  result.solver_violation = number("solver_violation");
  result.cost = number("cost");
  return result;
}

struct PackedJob {
  std::int64_t id = 0, waypoints = 0;
};

// Reads the solutions of results, which belong to the jobs of the same position. Many waypoints are read at once.
void ReadSolutions(ResultSource& source, const std::vector<PackedJob>& jobs, Archive* archive) {
  constexpr std::int64_t kWaypointsPerQuery = 20'000;
  std::map<std::int64_t, ArchivedResult*> by_job;
  for (std::size_t i = 0; i < jobs.size(); ++i) by_job[jobs[i].id] = &archive->results[i];
  for (std::size_t next = 0; next < jobs.size();) {
    std::vector<std::int64_t> some;
    for (std::int64_t waypoints = 0; next < jobs.size() && (some.empty() || waypoints < kWaypointsPerQuery); ++next) {
      waypoints += jobs[next].waypoints;
      some.push_back(jobs[next].id);
    }
    const Listing rows = source.Query(db::Sql(db::Query::kWaypointsOfJobs, {{"job_ids", some}}));
    for (std::size_t i = 0; i < rows.rows.size(); ++i) {
      const auto job = rows.At(i, "job_id").get<std::int64_t>();
      // A motion with an unsolved window has only the waypoints before it: no solution.
      if (by_job.at(job)->verdicts[Rule::kLiteral] == Verdict::kWindowUnsolved) continue;
      by_job.at(job)->waypoints.push_back(WaypointAt(rows, i, "x", "job " + std::to_string(job)));
    }
  }
}

}  // namespace

ArchiveAbout ReadAbout(const std::filesystem::path& file) {
  const YAML::Node node = ReadYamlFile(file);
  const YamlMap map(node, file.string(), "", {"title", "authors", "paper", "licence", "code", "notes"});
  ArchiveAbout about;
  constexpr std::size_t kMost = 10'000;
  const auto read = [&](const char* key, std::string* text) {
    if (!map.Has(key)) return;
    *text = map.String(key);
    if (text->size() > kMost) {
      throw YamlFault(map.file(), map.Get(key), key, "has more than " + std::to_string(kMost) + " bytes", "shorten it");
    }
  };
  read("title", &about.title);
  read("paper", &about.paper);
  read("licence", &about.licence);
  read("code", &about.code);
  read("notes", &about.notes);
  if (map.Has("authors")) {
    for (const YAML::Node& author : map.List("authors"))
      about.authors.push_back(YamlString(author, map.file(), "authors"));
  }
  return about;
}

Archive PackExperiment(ResultSource& source, std::optional<std::int64_t> experiment_id, ArchiveAbout about) {
  const ExperimentInfo info = FindExperiment(source, experiment_id);
  Archive archive;
  archive.about = std::move(about);
  archive.experiment = info.name;
  archive.dataset = info.dataset_name;
  archive.dataset_hash = info.dataset_hash;
  archive.rule = info.rule;
  ReadSpec(source, info.id, &archive);
  const Listing methods = source.Query(db::Sql(db::Query::kArchivedMethods, {{"experiment_id", info.id}}));
  std::map<std::int64_t, std::size_t> method_of;
  for (std::size_t i = 0; i < methods.rows.size(); ++i) {
    method_of[methods.At(i, "method_id").get<std::int64_t>()] = i;
    archive.methods.push_back({methods.Text(i, "name"), methods.Text(i, "hash"), methods.Text(i, "options_json"),
                               methods.At(i, "multi_starts").get<int>(), methods.At(i, "sample_size").get<int>()});
  }
  const Listing rows = source.Query(db::Sql(db::Query::kArchivedResults, {{"experiment_id", info.id}}));
  std::vector<PackedJob> jobs;
  for (std::size_t i = 0; i < rows.rows.size(); ++i) {
    jobs.push_back({rows.At(i, "job_id").get<std::int64_t>(), rows.At(i, "num_waypoints").get<std::int64_t>()});
    archive.results.push_back(ResultAt(rows, i));
    archive.results.back().method = method_of.at(rows.At(i, "method_id").get<std::int64_t>());
    archive.results.back().build = BuildAt(rows, i, &archive);
  }
  if (jobs.empty()) {
    throw ClientError(ExitCode::kUsage,
                      "experiment " + std::to_string(info.id) + " '" + info.name + "' has no results");
  }
  ReadSolutions(source, jobs, &archive);
  return archive;
}

}  // namespace legopt::client
