#include "legopt/dataset/problem_file.h"

#include <nlohmann/json.hpp>
#include <set>

#include "legopt/input/json.h"
#include "legopt/types/enum_input.h"
#include "legopt/types/input_error.h"

namespace legopt {
namespace {

using Json = nlohmann::json;

[[noreturn]] void Fail(const std::string& file, std::string field, std::string value, std::string message,
                       std::string fix) {
  throw InputError({.file = file,
                    .field = std::move(field),
                    .value = std::move(value),
                    .message = std::move(message),
                    .fix = std::move(fix)});
}

std::string OptionalText(const Json& root, const char* key, const std::string& file) {
  const auto entry = root.find(key);
  if (entry == root.end() || entry->is_null()) return {};
  if (!entry->is_string()) Fail(file, key, Dump(*entry), "must be a text", "write a JSON string");
  return entry->get<std::string>();
}

int ParseId(const Json& problem, size_t index, const std::string& file) {
  const std::string field = "problems[" + std::to_string(index) + "].id";
  const auto entry = problem.find("id");
  if (entry == problem.end()) Fail(file, field, "", "the key is missing", "give every problem an integer id");
  constexpr std::int64_t kMaxId = 1'000'000'000;
  if (!entry->is_number_integer() || *entry < 0 || *entry > kMaxId) {
    Fail(file, field, Dump(*entry), "must be an integer that is not negative", "number the problems 0, 1, 2, ...");
  }
  return entry->get<int>();
}

std::vector<Stance> ParseDefinition(const Json& definition, int id, const std::string& file) {
  const std::string place = "problem " + std::to_string(id);
  if (!definition.is_array() || definition.empty()) {
    Fail(file, place + ", definition", "", "must be a list of at least one stance string", "see the LegOpt format");
  }
  std::vector<Stance> stances;
  stances.reserve(definition.size());
  for (size_t s = 0; s < definition.size(); ++s) {
    const std::string field = place + ", stance " + std::to_string(s);
    if (!definition[s].is_string()) Fail(file, field, Dump(definition[s]), "must be a text", "write a stance string");
    stances.push_back(ParseStance(definition[s].get_ref<const std::string&>(), {.file = file, .field = field}));
  }
  return stances;
}

}  // namespace

Task TaskOf(const ProblemFile& file) {
  if (file.task) return *file.task;
  for (const ProblemDefinition& problem : file.problems) {
    if (!problem.stances.empty()) return problem.stances.size() == 1 ? Task::kPosture : Task::kMotion;
  }
  return Task::kPosture;
}

ProblemFile ReadProblemFile(const std::filesystem::path& path) {
  return ParseProblemFile(ReadJsonFile(path), path.string(), false);
}

ProblemFile ParseProblemFile(const Json& root, const std::string& file_for_errors, bool definition_optional) {
  if (!root.is_object()) Fail(file_for_errors, "", "", "the root must be a JSON object", "write {\"problems\": [...]}");
  const auto list = root.find("problems");
  if (list == root.end() || !list->is_array()) {
    Fail(file_for_errors, "problems", "", "the list of problems is missing", "write {\"problems\": [...]}");
  }
  ProblemFile file{.robot = OptionalText(root, "robot", file_for_errors),
                   .scenario = OptionalText(root, "scenario", file_for_errors),
                   .task = std::nullopt,
                   .problems = {}};
  const std::string task = OptionalText(root, "task", file_for_errors);
  if (!task.empty()) file.task = ReadTask(task, file_for_errors);
  std::set<int> ids;
  for (size_t i = 0; i < list->size(); ++i) {
    const Json& entry = (*list)[i];
    const std::string field = "problems[" + std::to_string(i) + "]";
    if (!entry.is_object()) Fail(file_for_errors, field, Dump(entry), "must be an object", "write {\"id\": ...}");
    ProblemDefinition problem{.id = ParseId(entry, i, file_for_errors), .stances = {}};
    if (!ids.insert(problem.id).second) {
      Fail(file_for_errors, field + ".id", std::to_string(problem.id), "the id is used twice", "renumber one of them");
    }
    const auto definition = entry.find("definition");
    if (definition != entry.end()) {
      problem.stances = ParseDefinition(*definition, problem.id, file_for_errors);
    } else if (!definition_optional) {
      Fail(file_for_errors, field + ".definition", "", "the key is missing", "add the list of stance strings");
    }
    file.problems.push_back(std::move(problem));
  }
  return file;
}

}  // namespace legopt
