#include "server/spec.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>
#include <vector>

#include "bus/message_limits.h"
#include "legopt/input/json.h"
#include "legopt/input/text.h"
#include "legopt/math/blake2b.h"
#include "legopt/types/experiment.h"
#include "legopt/types/input_error.h"

namespace legopt::server {
namespace {

using Json = nlohmann::json;
namespace limits = bus::spec_limits;
static_assert(limits::kMostNameBytes == db::kMaxNameBytes);

constexpr int kSpecVersion = 1;
constexpr double kBytesPerMb = 1 << 20;

[[noreturn]] void Refuse(const std::string& key, const std::string& what) {
  throw SpecError("experiment spec: " + key + ": " + what);
}

// Unknown keys are errors, because they would silently have no effect.
const Json& RequireObject(const Json& json, const std::string& key, const std::vector<std::string_view>& allowed) {
  if (!json.is_object()) Refuse(key, "must be an object");
  for (const auto& [name, value] : json.items()) {
    bool known = false;
    for (const std::string_view candidate : allowed) known = known || name == candidate;
    if (!known) Refuse(key.empty() ? name : key + "." + name, "unknown key");
  }
  return json;
}

const Json& Member(const Json& object, const std::string& key, std::string_view name) {
  const auto found = object.find(name);
  if (found == object.end()) Refuse((key.empty() ? "" : key + ".") + std::string(name), "missing");
  return *found;
}

const Json& Array(const Json& json, const std::string& key, std::size_t max_size) {
  if (!json.is_array() || json.empty() || json.size() > max_size) {
    Refuse(key, "must be a list of 1 to " + std::to_string(max_size) + " entries");
  }
  return json;
}

std::int64_t Integer(const Json& json, const std::string& key, std::int64_t low, std::int64_t high) {
  const bool fits = json.is_number_unsigned() ? json.get<std::uint64_t>() <= static_cast<std::uint64_t>(high)
                                              : json.is_number_integer() && json.get<std::int64_t>() <= high;
  if (!fits || json.get<std::int64_t>() < low) {
    Refuse(key, Dump(json) + " is not an integer from " + std::to_string(low) + " to " + std::to_string(high));
  }
  return json.get<std::int64_t>();
}

double Number(const Json& json, const std::string& key, double low, double high) {
  const double value = json.is_number() ? json.get<double>() : std::nan("");
  if (!(value >= low && value <= high)) {
    Refuse(key, Dump(json) + " is not a number from " + Dump(Json(low)) + " to " + Dump(Json(high)));
  }
  return value;
}

Json ReadSpecJson(std::string_view text) {
  try {
    return ParseJson(text, "experiment spec", {.bytes = limits::kMostBytes});
  } catch (const InputError& error) {
    throw SpecError(error.what());
  }
}

std::string Text(const Json& json, const std::string& key) {
  if (!json.is_string()) Refuse(key, "must be a text");
  std::string text = json.get<std::string>();
  if (text.empty() || text.size() > limits::kMostNameBytes || text.find('\0') != std::string::npos) {
    Refuse(key, "must have 1 to " + std::to_string(limits::kMostNameBytes) + " bytes");
  }
  return text;
}

std::string Name(const Json& json, const std::string& key) {
  std::string name = Text(json, key);
  if (const auto fault = DiagnoseName(name)) Refuse(key, fault->message + "; " + fault->fix);
  return name;
}

// Returns e.g. "neither 'a' nor 'b'", "neither 'a', 'b' nor 'c'".
template <NamedEnum Enum>
std::string NoneOfTheNames() {
  std::string text;
  for (const auto& [value, word] : kEnumNames<Enum>) {
    const bool last = word == kEnumNames<Enum>.back().word;
    text += (text.empty() ? "neither '" : last ? " nor '" : ", '") + std::string(word) + "'";
  }
  return text;
}

bool Boolean(const Json& json, const std::string& key) {
  if (!json.is_boolean()) Refuse(key, "must be true or false");
  return json.get<bool>();
}

template <NamedEnum Enum>
Enum Choice(const Json& json, const std::string& key) {
  const auto value = json.is_string() ? ParseEnum<Enum>(json.get_ref<const std::string&>()) : std::nullopt;
  if (!value) Refuse(key, Dump(json) + " is " + NoneOfTheNames<Enum>());
  return *value;
}

std::string Hash(const Json& json, const std::string& key) {
  std::string hash = Text(json, key);
  if (!IsBlake2bHex(hash)) Refuse(key, "must be 64 lower-case hexadecimal digits");
  return hash;
}

db::DatasetRecord ParseDataset(const Json& json) {
  constexpr std::size_t kMaxJoints = 1000;
  RequireObject(json, "dataset", {"name", "hash", "joint_names"});
  db::DatasetRecord dataset;
  dataset.name = Name(Member(json, "dataset", "name"), "dataset.name");
  dataset.hash = Hash(Member(json, "dataset", "hash"), "dataset.hash");
  if (!json.contains("joint_names")) return dataset;
  for (const Json& name : Array(json.at("joint_names"), "dataset.joint_names", kMaxJoints)) {
    dataset.joint_names.push_back(Text(name, "dataset.joint_names"));
  }
  return dataset;
}

ExperimentSpec::TaskProblems ParseTask(const Json& json, const std::string& key) {
  RequireObject(json, key, {"task", "problems", "waypoints"});
  ExperimentSpec::TaskProblems task;
  task.task = Choice<Task>(Member(json, key, "task"), key + ".task");
  const Json& problems = Array(Member(json, key, "problems"), key + ".problems", kMaxJobsPerExperiment);
  const Json& waypoints = Array(Member(json, key, "waypoints"), key + ".waypoints", kMaxJobsPerExperiment);
  if (waypoints.size() != problems.size()) {
    Refuse(key + ".waypoints",
           "has " + std::to_string(waypoints.size()) + " entries for " + std::to_string(problems.size()) + " problems");
  }
  std::set<int> seen;
  for (std::size_t i = 0; i < problems.size(); ++i) {
    const auto id = static_cast<int>(Integer(problems[i], key + ".problems", 0, limits::kMaxProblemId));
    if (!seen.insert(id).second) Refuse(key + ".problems", "problem " + std::to_string(id) + " stands there twice");
    task.problems.push_back(id);
    task.waypoints.push_back(static_cast<int>(Integer(waypoints[i], key + ".waypoints", 1, limits::kMaxWaypoints)));
  }
  return task;
}

db::MethodRecord ParseMethod(const Json& json, const std::string& key) {
  RequireObject(json, key, {"name", "hash", "options", "multi_starts", "sample_size", "incremental"});
  db::MethodRecord method;
  method.name = Name(Member(json, key, "name"), key + ".name");
  method.hash = Hash(Member(json, key, "hash"), key + ".hash");
  const Json& options = Member(json, key, "options");
  if (!options.is_object()) Refuse(key + ".options", "must be an object");
  method.options_json = Dump(options);
  method.multi_starts =
      static_cast<int>(Integer(Member(json, key, "multi_starts"), key + ".multi_starts", 0, limits::kMaxMultiStarts));
  method.sample_size_percent =
      static_cast<int>(Integer(Member(json, key, "sample_size"), key + ".sample_size", 1, 100));
  method.incremental = Boolean(Member(json, key, "incremental"), key + ".incremental");
  if (const auto solver = options.find("options"); solver != options.end() && solver->contains("collision")) {
    method.collision = Choice<SceneRepresentation>(solver->at("collision"), key + ".options.options.collision");
  }
  return method;
}

void ParseLists(const Json& json, ExperimentSpec& spec) {
  std::set<Task> tasks;
  for (const Json& task : Array(Member(json, "", "tasks"), "tasks", kNumEnumerators<Task>)) {
    spec.tasks.push_back(ParseTask(task, "tasks[" + std::to_string(spec.tasks.size()) + "]"));
    if (!tasks.insert(spec.tasks.back().task).second) Refuse("tasks", "a task stands there twice");
  }
  std::set<Initialization> initializations;
  for (const Json& initialization :
       Array(Member(json, "", "initializations"), "initializations", kNumEnumerators<Initialization>)) {
    spec.initializations.push_back(Choice<Initialization>(initialization, "initializations"));
    if (!initializations.insert(spec.initializations.back()).second)
      Refuse("initializations", "one stands there twice");
  }
  std::set<std::string> methods;
  for (const Json& method : Array(Member(json, "", "methods"), "methods", limits::kMostMethods)) {
    spec.methods.push_back(ParseMethod(method, "methods[" + std::to_string(spec.methods.size()) + "]"));
    const db::MethodRecord& parsed = spec.methods.back();
    if (!methods.insert(parsed.hash + parsed.name).second) {
      Refuse("methods", "'" + parsed.name + "' stands there twice with the same options");
    }
  }
}

// Calls `read` with each task and its limit. `limit` is one value for all tasks, or a map with one value per task.
template <class Read>
void ParseTaskLimits(const Json& limit, const std::string& key, ExperimentSpec& spec, const Read& read) {
  std::vector<std::string_view> tasks;
  for (const auto& [task, word] : kEnumNames<Task>) tasks.push_back(word);
  if (limit.is_object()) RequireObject(limit, key, tasks);
  for (ExperimentSpec::TaskProblems& task : spec.tasks) {
    read(task, limit.is_object() ? Member(limit, key, ToString(task.task)) : limit);
  }
}

void ParseLimits(const Json& json, ExperimentSpec& spec) {
  constexpr double kMicrosecondsPerSecond = 1e6;
  const Json& object = RequireObject(json, "limits", {"effort_limit", "wall_time_s", "memory_mb"});
  const std::string wall_key = "limits.wall_time_s", effort_key = "limits.effort_limit";
  ParseTaskLimits(Member(object, "limits", "wall_time_s"), wall_key, spec, [&](auto& task, const Json& limit) {
    task.wall_limit_us =
        std::llround(kMicrosecondsPerSecond * Number(limit, wall_key, limits::kMinWallTime_s, limits::kMaxWallTime_s));
  });
  if (object.contains("effort_limit")) {
    ParseTaskLimits(object.at("effort_limit"), effort_key, spec, [&](auto& task, const Json& limit) {
      task.effort_limit = Integer(limit, effort_key, 1, limits::kMaxEffort);
    });
  }
  spec.memory_limit_bytes =
      std::llround(kBytesPerMb * Number(Member(object, "limits", "memory_mb"), "limits.memory_mb",
                                        double{limits::kMinMemory_mb}, double{limits::kMaxMemory_mb}));
}

// Computed in floating point first: the product of four legal sizes may overflow an integer.
void CheckSize(const ExperimentSpec& spec) {
  double jobs = 0;
  for (const auto& task : spec.tasks) jobs += static_cast<double>(task.problems.size());
  jobs *= static_cast<double>(spec.methods.size() * spec.initializations.size()) * spec.repetitions;
  if (jobs > static_cast<double>(kMaxJobsPerExperiment)) {
    Refuse("", "makes " + Dump(Json(jobs)) + " jobs, more than " + std::to_string(kMaxJobsPerExperiment) +
                   "; submit it in parts");
  }
}

// The spec's split appears in tables, so all problems must belong to it.
void CheckSplit(Split split, const ExperimentSpec& spec) {
  for (const auto& task : spec.tasks) {
    for (const int id : task.problems) {
      if (ContainsProblem(split, id)) continue;
      Refuse("split", std::string(ToString(split)) + " has no problem " + std::to_string(id));
    }
  }
}

}  // namespace

std::int64_t ExperimentSpec::num_jobs() const {
  std::size_t problems = 0;
  for (const TaskProblems& task : tasks) problems += task.problems.size();
  return static_cast<std::int64_t>(problems * methods.size() * initializations.size()) * repetitions;
}

ExperimentSpec ParseSpec(std::string_view text) {
  const Json json = ReadSpecJson(text);
  RequireObject(json, "",
                {"spec_version", "name", "seed", "repetitions", "dataset", "tasks", "initializations", "methods",
                 "limits", "max_attempts", "submitter", "builds", "again", "split", "rule"});
  Integer(Member(json, "", "spec_version"), "spec_version", kSpecVersion, kSpecVersion);
  ExperimentSpec spec;
  spec.name = Name(Member(json, "", "name"), "name");
  if (json.contains("submitter")) spec.submitter = Name(json.at("submitter"), "submitter");
  if (json.contains("builds")) spec.builds = Choice<BuildPolicy>(json.at("builds"), "builds");
  if (json.contains("rule")) spec.rule = Choice<Rule>(json.at("rule"), "rule");
  if (json.contains("again")) spec.again = Boolean(json.at("again"), "again");
  spec.seed = Integer(Member(json, "", "seed"), "seed", 0, INT64_MAX);
  spec.repetitions =
      static_cast<int>(Integer(Member(json, "", "repetitions"), "repetitions", 1, limits::kMaxRepetitions));
  spec.dataset = ParseDataset(Member(json, "", "dataset"));
  ParseLists(json, spec);
  if (json.contains("split")) CheckSplit(Choice<Split>(json.at("split"), "split"), spec);
  ParseLimits(Member(json, "", "limits"), spec);
  if (json.contains("max_attempts")) {
    spec.max_attempts = static_cast<int>(Integer(json.at("max_attempts"), "max_attempts", 1, limits::kMostAttempts));
  }
  CheckSize(spec);
  spec.canonical_json = Dump(json);
  spec.hash = Blake2bHex(spec.canonical_json);
  return spec;
}

JobCoordinates CoordinatesOf(const ExperimentSpec& spec, std::int64_t index) {
  std::size_t rest = static_cast<std::size_t>(index);
  JobCoordinates at{};
  const auto repetitions = static_cast<std::size_t>(spec.repetitions);
  const std::size_t per_method =
      static_cast<std::size_t>(spec.num_jobs()) / spec.methods.size();  // the method is the slowest index
  at.method = rest / per_method;
  rest %= per_method;
  for (at.task = 0;; ++at.task) {
    const std::size_t per_task = spec.tasks[at.task].problems.size() * spec.initializations.size() * repetitions;
    if (rest < per_task) break;
    rest -= per_task;
  }
  const std::size_t per_initialization = spec.tasks[at.task].problems.size() * repetitions;
  at.initialization = rest / per_initialization;
  rest %= per_initialization;
  at.problem = rest / repetitions;
  at.repetition = rest % repetitions;
  return at;
}

}  // namespace legopt::server
