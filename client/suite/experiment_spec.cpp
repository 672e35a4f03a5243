#include "client/suite/experiment_spec.h"

#include <pwd.h>
#include <sodium.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <iterator>

#include "bus/field_check.h"
#include "client/client_error.h"
#include "legopt/dataset/dataset.h"
#include "legopt/input/json.h"
#include "legopt/input/text.h"
#include "legopt/math/blake2b.h"
#include "legopt/types/input_error.h"

namespace legopt::client {
namespace {

constexpr int kSpecVersion = 1;
constexpr std::size_t kSubmissionIdBytes = 16;

std::string IdRange(const std::vector<DatasetFacts::Problem>& problems) {
  const auto [low, high] =
      std::minmax_element(problems.begin(), problems.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  return std::to_string(problems.size()) + " problems with ids from " + std::to_string(low->id) + " to " +
         std::to_string(high->id);
}

// Returns the limits of the suite's tasks; a single number if all are equal.
template <class Value>
nlohmann::json LimitJson(const Suite& suite, const EnumArray<Task, Value>& limit) {
  auto limits = nlohmann::json::object();
  for (const auto& task : suite.tasks) limits[std::string(ToString(task.task))] = limit[task.task];
  const bool same = std::all_of(limits.begin(), limits.end(), [&](const auto& one) { return one == *limits.begin(); });
  return same ? *limits.begin() : limits;
}

void RequireSome(const Suite& suite, const std::string& task, const std::vector<DatasetFacts::Problem>& selected) {
  if (!selected.empty()) return;
  throw InputError({suite.file, "split", std::string(ToString(suite.split)),
                    "has none of the chosen " + task + " problems", "choose others, or split: all"});
}

// Returns the problems of a task by the suite's selection and split, in its order.
std::vector<DatasetFacts::Problem> Select(const Suite& suite, const TaskSelection& selection,
                                          const DatasetFacts& dataset) {
  const auto& available = dataset.problems[selection.task];
  const std::string task(ToString(selection.task));
  if (available.empty()) {
    throw InputError({suite.file, "tasks", task, "the dataset '" + dataset.name + "' has no such problems",
                      "remove the task (--tasks) or choose another dataset"});
  }
  std::vector<DatasetFacts::Problem> selected;
  if (!selection.problems) {
    std::copy_if(available.begin(), available.end(), std::back_inserter(selected),
                 [&](const auto& problem) { return ContainsProblem(suite.split, problem.id); });
    RequireSome(suite, task, selected);
    return selected;
  }
  for (const int id : *selection.problems) {
    const auto found = std::find_if(available.begin(), available.end(), [&](const auto& p) { return p.id == id; });
    if (found == available.end()) {
      throw InputError({suite.file, "problems", std::to_string(id),
                        "is not a " + task + " problem of the dataset '" + dataset.name + "'",
                        "it has " + IdRange(available)});
    }
    if (ContainsProblem(suite.split, id)) selected.push_back(*found);
  }
  RequireSome(suite, task, selected);
  return selected;
}

// Removes long problems; returns a sentence about them, empty if there are none.
std::string LeaveOutLongProblems(const Suite& suite, Task task, std::vector<DatasetFacts::Problem>* problems) {
  if (!suite.max_stances) return {};
  const int most = NumWaypoints(task, *suite.max_stances);
  const auto erased = std::erase_if(*problems, [most](const auto& problem) { return problem.waypoints > most; });
  if (erased == 0) return {};
  const std::string word(ToString(task));
  const std::string longer = "longer than " + std::to_string(*suite.max_stances) + " stances (max_stances)";
  if (problems->empty()) {
    return "no " + word + " is left: all " + std::to_string(erased) + " chosen problems are " + longer;
  }
  return std::to_string(erased) + " of " + std::to_string(erased + problems->size()) + " " + word + " problems are " +
         longer;
}

// Returns the suite's tasks with their problems. A task whose problems are all too long is omitted if another task
// remains.
nlohmann::json TasksJson(const Suite& suite, const DatasetFacts& dataset, std::vector<std::string>* left_out) {
  auto tasks = nlohmann::json::array();
  std::string emptied;
  for (const TaskSelection& selection : suite.tasks) {
    const std::string word(ToString(selection.task));
    auto problems = Select(suite, selection, dataset);
    const std::string loss = LeaveOutLongProblems(suite, selection.task, &problems);
    if (!loss.empty() && left_out != nullptr) left_out->push_back(loss);
    if (problems.empty()) {
      emptied += (emptied.empty() ? "" : " and no ") + word + " problem";
      continue;
    }
    auto ids = nlohmann::json::array(), waypoints = nlohmann::json::array();
    for (const auto& problem : problems) {
      ids.push_back(problem.id);
      waypoints.push_back(problem.waypoints);
    }
    tasks.push_back({{"task", word}, {"problems", std::move(ids)}, {"waypoints", std::move(waypoints)}});
  }
  if (!tasks.empty()) return tasks;
  throw InputError({suite.file, "max_stances", std::to_string(suite.max_stances.value_or(0)), "leaves no " + emptied,
                    "raise it, or choose other problems"});
}

nlohmann::json InitializationsJson(const Suite& suite) {
  auto words = nlohmann::json::array();
  for (const Initialization initialization : suite.initializations) words.push_back(ToString(initialization));
  return words;
}

nlohmann::json MethodJson(const Method& method) {
  return {{"name", method.name},
          {"hash", method.Hash()},
          {"options", method.ToJson()},
          {"multi_starts", method.multi_starts},
          {"sample_size", method.sample_size_percent},
          {"incremental", method.incremental}};
}

nlohmann::json DatasetJson(const DatasetFacts& dataset) {
  nlohmann::json json{{"name", dataset.name}, {"hash", dataset.hash}};
  if (!dataset.joint_names.empty()) json["joint_names"] = dataset.joint_names;
  return json;
}

std::vector<std::string> JointNames(const RobotModel& robot) {
  std::vector<std::string> names;
  for (int dof = 0; dof < robot.num_dofs(); ++dof) {
    names.push_back(robot.joints()[static_cast<std::size_t>(robot.dof_joint(dof))].name);
  }
  return names;
}

std::vector<DatasetFacts::Problem> ProblemFacts(const Dataset& dataset, Task task) {
  const std::vector<ProblemDefinition>& problems = dataset.problems(task);
  std::vector<DatasetFacts::Problem> facts;
  facts.reserve(problems.size());
  for (const auto& problem : problems) {
    facts.push_back({problem.id, NumWaypoints(task, static_cast<int>(problem.stances.size()))});
  }
  return facts;
}

}  // namespace

DatasetFacts FactsOf(const Dataset& dataset) {
  DatasetFacts facts;
  facts.name = dataset.name();
  facts.hash = dataset.content_hash();
  for (const TaskDescription& task : kTasks) facts.problems[task.task] = ProblemFacts(dataset, task.task);
  facts.joint_names = JointNames(dataset.robot());
  return facts;
}

nlohmann::json BuildSpec(const Suite& suite, const DatasetFacts& dataset, std::vector<std::string>* left_out) {
  auto methods = nlohmann::json::array();
  for (const auto& method : suite.methods) methods.push_back(MethodJson(method));
  nlohmann::json spec = {{"spec_version", kSpecVersion},
                         {"name", suite.name},
                         {"seed", suite.seed},
                         {"repetitions", suite.repetitions},
                         {"dataset", DatasetJson(dataset)},
                         {"tasks", TasksJson(suite, dataset, left_out)},
                         {"initializations", InitializationsJson(suite)},
                         {"methods", std::move(methods)},
                         {"limits",
                          {{"effort_limit", LimitJson(suite, suite.effort_limit)},
                           {"wall_time_s", LimitJson(suite, suite.wall_time_s)},
                           {"memory_mb", suite.memory_mb}}},
                         {"max_attempts", suite.max_attempts}};
  // Default values are omitted, so that existing ids do not change.
  if (suite.builds != BuildPolicy::kOne) spec["builds"] = ToString(suite.builds);
  if (suite.rule != Rule::kSolid) spec["rule"] = ToString(suite.rule);
  if (suite.split != Split::kAll) spec["split"] = ToString(suite.split);
  return spec;
}

std::string SubmitterName() {
  constexpr std::size_t kMostBytes = 200;
  const char* given = std::getenv("LEGOPT_SUBMITTER");
  if (given == nullptr) {
    const passwd* user = getpwuid(geteuid());
    const std::string name = user == nullptr ? "" : user->pw_name;
    return DiagnoseName(name) ? "uid " + std::to_string(geteuid()) : name;
  }
  std::string name = given;
  if (name.size() > kMostBytes || !bus::IsText(name)) {
    throw InputError({"LEGOPT_SUBMITTER", "", name.substr(0, kMostBytes), "is not UTF-8 of at most 200 bytes",
                      "set it to who submits, or unset it"});
  }
  if (!name.empty()) RequireName(name, "LEGOPT_SUBMITTER", "");
  return name;
}

std::int64_t CountJobs(const nlohmann::json& spec) {
  std::int64_t problems = 0;
  for (const auto& task : spec.at("tasks")) problems += static_cast<std::int64_t>(task.at("problems").size());
  return problems * static_cast<std::int64_t>(spec.at("methods").size()) *
         static_cast<std::int64_t>(spec.at("initializations").size()) * spec.at("repetitions").get<std::int64_t>();
}

std::string ContentSubmissionId(const nlohmann::json& spec) { return Blake2bHex(Dump(spec), kSubmissionIdBytes); }

std::string RandomSubmissionId() {
  if (sodium_init() < 0) throw ClientError(ExitCode::kInternal, "libsodium cannot start");
  std::array<unsigned char, kSubmissionIdBytes> bytes{};
  randombytes_buf(bytes.data(), bytes.size());
  return HexText(bytes);
}

}  // namespace legopt::client
