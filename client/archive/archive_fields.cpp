#include "client/archive/archive_fields.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string_view>
#include <utility>

#include "bus/message_limits.h"
#include "db/records.h"
#include "legopt/input/json.h"
#include "legopt/input/text.h"
#include "legopt/math/blake2b.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;

namespace limits = bus::spec_limits;

constexpr std::size_t kMaxText = 10'000, kMaxItems = 1'000'000;
constexpr std::size_t kMaxOptions = std::size_t{1} << 20;  // limit of a submission

/// Reads the members of a JSON object; `Finish` refuses those that were not read.
class Members {
 public:
  Members(const Json& json, std::string source, std::string path)
      : json_(json), source_(std::move(source)), path_(std::move(path)) {
    if (!json.is_object()) Refuse("", "is no JSON object");
  }

  bool Has(const std::string& key) const { return json_.contains(key); }
  const Json& Get(const std::string& key) {
    read_.insert(key);
    if (!json_.contains(key)) Refuse(key, "is missing");
    return json_.at(key);
  }
  std::string Text(const std::string& key, std::size_t most = kMaxText) { return TextOf(Get(key), key, most); }
  std::int64_t Integer(const std::string& key, std::int64_t low, std::int64_t high) {
    const Json& value = Get(key);
    const bool whole =
        value.is_number_integer() &&
        !(value.is_number_unsigned() &&
          value.get<std::uint64_t>() > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()));
    if (!whole || value.get<std::int64_t>() < low || value.get<std::int64_t>() > high) {
      Refuse(key, "must be a whole number from " + std::to_string(low) + " to " + std::to_string(high), Dump(value));
    }
    return value.get<std::int64_t>();
  }
  double Number(const std::string& key, double low, double high) {
    const Json& value = Get(key);
    if (!value.is_number() || value.get<double>() < low || value.get<double>() > high) {
      Refuse(key, "must be a number from " + FormatGeneral(low) + " to " + FormatGeneral(high), Dump(value));
    }
    return value.get<double>();
  }
  /// A number that may be absent.
  std::optional<double> FiniteNumber(const std::string& key) {
    if (!Has(key)) return std::nullopt;
    return Number(key, std::numeric_limits<double>::lowest(), std::numeric_limits<double>::max());
  }
  template <NamedEnum Enum>
  Enum Word(const std::string& key) {
    return WordOf<Enum>(Get(key), key);
  }
  const Json& List(const std::string& key) {
    const Json& value = Get(key);
    if (!value.is_array() || value.size() > kMaxItems) {
      Refuse(key, "must be a list of at most " + std::to_string(kMaxItems) + " items");
    }
    return value;
  }
  /// A name by the rules of DiagnoseName.
  std::string Name(const std::string& key) {
    std::string name = Text(key, limits::kMostNameBytes);
    if (const auto fault = DiagnoseName(name)) Refuse(key, fault->message, name);
    return name;
  }
  std::string TextOf(const Json& value, const std::string& key, std::size_t most = kMaxText) const {
    if (!value.is_string() || value.get_ref<const std::string&>().size() > most) {
      Refuse(key, "must be a text of at most " + std::to_string(most) + " bytes", Dump(value));
    }
    return value.get<std::string>();
  }
  template <NamedEnum Enum>
  Enum WordOf(const Json& value, const std::string& key) const {
    const auto word = value.is_string() ? ParseEnum<Enum>(value.get_ref<const std::string&>()) : std::nullopt;
    if (!word) Refuse(key, "is none of the known words", Dump(value));
    return *word;
  }
  void Finish() const {
    for (const auto& [key, value] : json_.items()) {
      if (read_.count(key) == 0) Refuse(key, "is an unknown key");
    }
  }
  [[noreturn]] void Refuse(const std::string& key, const std::string& message, const std::string& value = {}) const {
    throw InputError(
        {source_, path_ + key, value.substr(0, kShown), message, "pack the archive again with 'legopt archive pack'"});
  }

 private:
  static constexpr std::size_t kShown = 100;

  const Json& json_;
  std::string source_, path_;
  std::set<std::string> read_;
};

ArchiveAbout AboutOf(const Json& json, const std::string& source) {
  Members members(json, source, "about.");
  ArchiveAbout about;
  about.title = members.Text("title");
  for (const Json& author : members.List("authors")) about.authors.push_back(members.TextOf(author, "authors"));
  about.paper = members.Text("paper");
  about.licence = members.Text("licence");
  about.code = members.Text("code");
  about.notes = members.Text("notes");
  members.Finish();
  return about;
}

ArchivedTask TaskOf(const Json& json, const std::string& source) {
  Members members(json, source, "tasks.");
  ArchivedTask task;
  task.task = members.Word<Task>("task");
  for (const Json& problem : members.List("problems")) {
    const bool valid = problem.is_number_unsigned() &&
                       problem.get<std::uint64_t>() <= static_cast<std::uint64_t>(limits::kMaxProblemId);
    if (!valid) members.Refuse("problems", "must be ids of problems", Dump(problem));
    if (!task.problems.empty() && problem.get<int>() <= task.problems.back()) {
      members.Refuse("problems", "must be ascending, each once", Dump(problem));
    }
    task.problems.push_back(problem.get<int>());
  }
  if (task.problems.empty()) members.Refuse("problems", "is empty");
  members.Finish();
  return task;
}

// The hash of a method's options, see Method::Hash; empty for a text that is no JSON object.
std::string HashOfOptions(const std::string& text) {
  auto options = TryParseJson(text);
  if (!options || !options->is_object()) return {};
  options->erase("name");
  return Blake2bHex(Dump(*options));
}

// Refuses options whose parts have other types than those of a method, and labels that contradict them.
void RequireSoundOptions(const ArchivedMethod& method, const Members& members) {
  const auto options = ParseJson(method.options, "options");
  const auto require = [&](bool sound, const char* key) {
    if (!sound) members.Refuse("options", "has a wrong value of '" + std::string(key) + "'");
  };
  const auto label = [&](const char* key, int value) {
    require(!options.contains(key) || options.at(key) == value, key);
  };
  label("multi_starts", method.multi_starts);
  label("sample_size", method.sample_size);
  require(!options.contains("incremental") || options.at("incremental").is_boolean(), "incremental");
  if (!options.contains("options")) return;
  const auto& own = options.at("options");
  require(own.is_object(), "options");
  require(!own.contains("rescues") || own.at("rescues").is_number_integer(), "rescues");
  require(
      !own.contains("collision") || (own.at("collision").is_string() &&
                                     ParseEnum<SceneRepresentation>(own.at("collision").get_ref<const std::string&>())),
      "collision");
}

ArchivedMethod MethodOf(const Json& json, const std::string& source) {
  Members members(json, source, "methods.");
  ArchivedMethod method;
  method.name = members.Name("name");
  method.hash = members.Text("hash");
  method.options = members.Text("options", kMaxOptions);
  if (method.hash != HashOfOptions(method.options)) members.Refuse("hash", "is not that of the options", method.hash);
  method.multi_starts = static_cast<int>(members.Integer("multi_starts", 0, std::numeric_limits<int>::max()));
  method.sample_size = static_cast<int>(members.Integer("sample_size", 1, 100));
  members.Finish();
  RequireSoundOptions(method, members);
  return method;
}

ArchivedBuild BuildOf(const Json& json, const std::string& source) {
  Members members(json, source, "builds.");
  ArchivedBuild build;
  build.id = members.Text("id", db::kMaxBuildIdBytes);
  if (build.id.find('\0') != std::string::npos) members.Refuse("id", "has a NUL character");
  if (build.id.empty()) {
    members.Refuse("id", "is empty: the results are of an unknown build and cannot be reproduced");
  }
  build.text = members.Text("text");
  build.processor = members.Text("processor");
  members.Finish();
  return build;
}

// A number that is not finite, of a solution that diverged, is null.
Json NumbersOf(const Eigen::VectorXd& values) {
  Json numbers = Json::array();
  for (const double value : values) numbers.push_back(std::isfinite(value) ? Json(value) : Json());
  return numbers;
}

Eigen::VectorXd WaypointOf(const Json& json, const Members& members) {
  constexpr std::size_t kMostNumbers = 10'000;
  if (!json.is_array() || json.size() > kMostNumbers) members.Refuse("x", "must be lists of numbers");
  Eigen::VectorXd waypoint(static_cast<Eigen::Index>(json.size()));
  Eigen::Index next = 0;
  for (const Json& value : json) {
    if (!value.is_number() && !value.is_null()) members.Refuse("x", "must be lists of numbers", Dump(value));
    waypoint[next++] = value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
  }
  return waypoint;
}

template <class Item, class Key>
bool AllDiffer(const std::vector<Item>& items, const Key& key) {
  std::set<decltype(key(items.front()))> keys;
  return std::ranges::all_of(items, [&](const Item& item) { return keys.insert(key(item)).second; });
}

// Refuses repeated tasks and initializations, and more jobs than an experiment may have.
void RequireSoundLists(const Archive& archive, const Members& members) {
  const std::pair<const char*, bool> lists[] = {{"tasks", archive.tasks.empty()},
                                                {"initializations", archive.initializations.empty()},
                                                {"methods", archive.methods.empty()},
                                                {"builds", archive.builds.empty()}};
  for (const auto& [key, empty] : lists) {
    if (empty) members.Refuse(key, "is empty");
  }
  if (!AllDiffer(archive.tasks, [](const ArchivedTask& task) { return task.task; }))
    members.Refuse("tasks", "names a task twice");
  if (!AllDiffer(archive.initializations, [](Initialization initialization) { return initialization; })) {
    members.Refuse("initializations", "names one twice");
  }
  if (archive.methods.size() > limits::kMostMethods) {
    members.Refuse("methods", "has more than " + std::to_string(limits::kMostMethods) + " methods",
                   std::to_string(archive.methods.size()));
  }
  if (!AllDiffer(archive.methods, [](const ArchivedMethod& method) { return method.hash + method.name; })) {
    members.Refuse("methods", "names one twice");
  }
  double jobs = 0.0;  // no overflow
  for (const ArchivedTask& task : archive.tasks) jobs += static_cast<double>(task.problems.size());
  jobs *= static_cast<double>(archive.methods.size() * archive.initializations.size()) * archive.repetitions;
  if (jobs > static_cast<double>(limits::kMaxJobs)) {
    members.Refuse("tasks", "has more than " + std::to_string(limits::kMaxJobs) + " jobs", FormatGeneral(jobs));
  }
}

Json AboutFields(const ArchiveAbout& about) {
  return {{"title", about.title},     {"authors", about.authors}, {"paper", about.paper},
          {"licence", about.licence}, {"code", about.code},       {"notes", about.notes}};
}

}  // namespace

Json HeaderFields(const Archive& archive) {
  Json json = {{"about", AboutFields(archive.about)},
               {"experiment", archive.experiment},
               {"dataset", archive.dataset},
               {"dataset_hash", archive.dataset_hash},
               {"seed", archive.seed},
               {"repetitions", archive.repetitions},
               {"rule", ToString(archive.rule)},
               {"tasks", Json::array()},
               {"initializations", Json::array()},
               {"methods", Json::array()},
               {"builds", Json::array()}};
  for (const ArchivedTask& task : archive.tasks) {
    json["tasks"].push_back({{"task", ToString(task.task)}, {"problems", task.problems}});
  }
  for (const Initialization initialization : archive.initializations) {
    json["initializations"].push_back(ToString(initialization));
  }
  for (const ArchivedMethod& method : archive.methods) {
    json["methods"].push_back({{"name", method.name},
                               {"hash", method.hash},
                               {"options", method.options},
                               {"multi_starts", method.multi_starts},
                               {"sample_size", method.sample_size}});
  }
  for (const ArchivedBuild& build : archive.builds) {
    json["builds"].push_back({{"id", build.id}, {"text", build.text}, {"processor", build.processor}});
  }
  return json;
}

Json ResultFields(const ArchivedResult& result) {
  Json json = {{"method", result.method},
               {"task", ToString(result.task)},
               {"initialization", ToString(result.initialization)},
               {"problem", result.problem},
               {"repetition", result.repetition},
               {"build", result.build},
               {"status", ToString(result.status)},
               {"cpu_us", result.cpu_us},
               {"work_ns", result.work_ns},
               {"evaluations", result.evaluations},
               {"queries", result.collision_queries},
               {"iterations", result.iterations},
               {"restarts", result.restarts},
               {"windows", result.windows},
               {"windows_solved", result.windows_solved},
               {"starts", result.starts},
               {"margin_relaxed", result.margin_relaxed}};
  for (const auto& [rule, word] : kEnumNames<Rule>) {
    if (result.verdicts[rule]) json[std::string(word)] = ToString(*result.verdicts[rule]);
  }
  if (result.window_verdict) json["window_verdict"] = ToString(*result.window_verdict);
  if (result.solver_cost) json["solver_cost"] = *result.solver_cost;
  if (result.solver_violation) json["solver_violation"] = *result.solver_violation;
  if (result.cost) json["cost"] = *result.cost;
  json["x"] = Json::array();
  for (const Eigen::VectorXd& waypoint : result.waypoints) json["x"].push_back(NumbersOf(waypoint));
  return json;
}

Archive HeaderOf(const Json& json, const std::string& source) {
  Members members(json, source, "");
  Archive archive;
  archive.about = AboutOf(members.Get("about"), source);
  archive.experiment = members.Name("experiment");
  archive.dataset = members.Name("dataset");
  archive.dataset_hash = members.Text("dataset_hash");
  if (!IsBlake2bHex(archive.dataset_hash))
    members.Refuse("dataset_hash", "must have 64 hex digits", archive.dataset_hash);
  archive.seed = members.Integer("seed", 0, std::numeric_limits<std::int64_t>::max());
  archive.repetitions = static_cast<int>(members.Integer("repetitions", 1, limits::kMaxRepetitions));
  archive.rule = members.Word<Rule>("rule");
  for (const Json& task : members.List("tasks")) archive.tasks.push_back(TaskOf(task, source));
  for (const Json& word : members.List("initializations")) {
    archive.initializations.push_back(members.WordOf<Initialization>(word, "initializations"));
  }
  for (const Json& method : members.List("methods")) archive.methods.push_back(MethodOf(method, source));
  for (const Json& build : members.List("builds")) archive.builds.push_back(BuildOf(build, source));
  members.Finish();
  RequireSoundLists(archive, members);
  return archive;
}

ArchivedResult ResultOf(const Json& json, const Archive& archive, const std::string& source) {
  constexpr std::size_t kMaxWaypoints = 100'000;
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
  Members members(json, source, "");
  const auto index = [&](const std::string& key, std::size_t size) {
    if (size == 0) members.Refuse(key, "refers to an empty list");
    return static_cast<std::size_t>(members.Integer(key, 0, static_cast<std::int64_t>(size) - 1));
  };
  ArchivedResult result;
  result.method = index("method", archive.methods.size());
  result.task = members.Word<Task>("task");
  result.initialization = members.Word<Initialization>("initialization");
  result.problem = static_cast<int>(members.Integer("problem", 0, std::numeric_limits<int>::max()));
  result.repetition = static_cast<int>(members.Integer("repetition", 0, archive.repetitions - 1));
  result.build = index("build", archive.builds.size());
  result.status = members.Word<SolveStatus>("status");
  result.cpu_us = members.Integer("cpu_us", 1, kMost);
  result.work_ns = members.Integer("work_ns", 0, kMost);
  result.evaluations = members.Integer("evaluations", 0, kMost);
  result.collision_queries = members.Integer("queries", 0, kMost);
  result.iterations = members.Integer("iterations", 0, std::numeric_limits<int>::max());
  result.restarts = members.Integer("restarts", 0, std::numeric_limits<int>::max());
  result.windows = members.Integer("windows", 0, std::numeric_limits<int>::max());
  result.windows_solved = members.Integer("windows_solved", 0, result.windows);
  if (members.Has("window_verdict")) result.window_verdict = members.Word<Verdict>("window_verdict");
  result.starts = members.Integer("starts", 0, std::numeric_limits<int>::max());
  result.margin_relaxed = members.Number("margin_relaxed", 0.0, 1.0);
  for (const auto& [rule, word] : kEnumNames<Rule>) {
    const std::string key(word);
    if (members.Has(key)) result.verdicts[rule] = members.Word<Verdict>(key);
  }
  result.solver_cost = members.FiniteNumber("solver_cost");
  result.solver_violation = members.FiniteNumber("solver_violation");
  result.cost = members.FiniteNumber("cost");
  if (members.List("x").size() > kMaxWaypoints)
    members.Refuse("x", "has more than " + std::to_string(kMaxWaypoints) + " waypoints");
  for (const Json& waypoint : members.List("x")) result.waypoints.push_back(WaypointOf(waypoint, members));
  members.Finish();
  const auto task = std::ranges::find(archive.tasks, result.task, &ArchivedTask::task);
  const bool declared = task != archive.tasks.end() && std::ranges::binary_search(task->problems, result.problem);
  if (!declared)
    members.Refuse("problem", "is not among the problems of the experiment", std::to_string(result.problem));
  if (std::ranges::find(archive.initializations, result.initialization) == archive.initializations.end()) {
    members.Refuse("initialization", "is not among those of the experiment");
  }
  return result;
}

}  // namespace legopt::client
