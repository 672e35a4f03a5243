#include "client/suite/suite.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "app/value_list.h"
#include "bus/message_limits.h"
#include "client/suite/yaml_map.h"
#include "legopt/files/written_file.h"
#include "legopt/input/text.h"
#include "legopt/input/yaml.h"
#include "legopt/types/input_error.h"
#include "legopt/types/nearest_name.h"
#include "worker/external/external_solvers.h"

namespace legopt::client {
namespace {

constexpr char kToleranceKey[] = "constraint_tolerance";
const std::vector<std::string> kSuiteKeys = {
    "name",    "dataset",         "seed",        "repetitions", "tasks",        "problems",
    "methods", "initializations", "max_stances", "limits",      "max_attempts", "collision",
    "builds",  "split",           "rule",        "pairs",       kToleranceKey};
const std::vector<std::string> kMethodKeys = {"name",        "solver",    "multi_starts", "sample_size",
                                              "incremental", "collision", "options"};

namespace limits = bus::spec_limits;
constexpr int kMaxProblemId = limits::kMaxProblemId;
// The limits for suites equal those of servers and workers.
static_assert(Method::kMaxMultiStarts == limits::kMaxMultiStarts);

template <NamedEnum Enum>
std::vector<std::string> EnumNamesOf() {
  std::vector<std::string> words;
  for (const EnumName<Enum>& row : kEnumNames<Enum>) words.emplace_back(row.word);
  return words;
}

template <NamedEnum Enum>
Enum ReadEnum(const YAML::Node& node, const std::string& file, const std::string& field) {
  const std::string text = YamlString(node, file, field);
  if (const auto value = ParseEnum<Enum>(text)) return *value;
  throw YamlFault(file, node, field, "is not known", SuggestName(text, EnumNamesOf<Enum>()));
}

std::vector<int> ReadProblems(const YamlMap& map) {
  std::vector<std::string> items;
  const auto nodes = map.List("problems");
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    items.push_back(YamlString(nodes[i], map.file(), map.Path("problems", i)));
  }
  return ParseProblemIds(items, YamlPlace(map.file(), map.Get("problems")), map.Path("problems"));
}

void ReadTasks(const YamlMap& map, Suite* suite) {
  std::optional<std::vector<int>> shared;
  if (map.Has("problems")) shared = ReadProblems(map);
  const auto nodes = map.List("tasks");
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const std::string path = map.Path("tasks", i);
    TaskSelection selection{{}, shared};
    if (nodes[i].IsMap()) {
      const YamlMap task(nodes[i], map.file(), path, {"task", "problems"});
      selection.task = ReadEnum<Task>(task.Get("task"), map.file(), task.Path("task"));
      if (task.Has("problems")) selection.problems = ReadProblems(task);
    } else {
      selection.task = ReadEnum<Task>(nodes[i], map.file(), path);
    }
    for (const auto& other : suite->tasks) {
      if (other.task == selection.task) {
        throw InputError({YamlPlace(map.file(), nodes[i]), path, std::string(ToString(selection.task)),
                          "task occurs twice", "join them"});
      }
    }
    suite->tasks.push_back(std::move(selection));
  }
}

Split ReadSplit(const YamlMap& map) {
  const std::string word = map.String("split");
  if (const auto split = ParseEnum<Split>(word)) return *split;
  throw YamlFault(map.file(), map.Get("split"), "split", "must be " + EnumChoices<Split>(),
                  "write tuning for the problems with an even id, test for those with an odd one");
}

Rule ReadRule(const YamlMap& map) {
  if (const auto rule = ParseEnum<Rule>(map.String("rule"))) return *rule;
  throw YamlFault(map.file(), map.Get("rule"), "rule", "must be " + EnumChoices<Rule>(),
                  "write solid, or literal to count as the original evaluator does");
}

std::optional<PairSelection> ReadPairs(const YamlMap& map) {
  if (!map.Has("pairs")) return std::nullopt;
  if (const auto pairs = ParseEnum<PairSelection>(map.String("pairs"))) return *pairs;
  throw YamlFault(map.file(), map.Get("pairs"), "pairs", "must be " + EnumChoices<PairSelection>(),
                  "write all, or reference to compare the original evaluator's pairs");
}

BuildPolicy ReadBuildRule(const YamlMap& map) {
  const std::string word = map.String("builds");
  if (const auto rule = ParseEnum<BuildPolicy>(word)) return *rule;
  throw YamlFault(map.file(), map.Get("builds"), "builds", "must be " + EnumChoices<BuildPolicy>(),
                  "write one, or any to let workers of all builds finish the experiment");
}

void ReadInitializations(const YamlMap& map, Suite* suite) {
  suite->initializations.clear();
  const auto nodes = map.List("initializations");
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const std::string path = map.Path("initializations", i);
    const auto initialization = ReadEnum<Initialization>(nodes[i], map.file(), path);
    if (std::ranges::count(suite->initializations, initialization) > 0) {
      throw YamlFault(map.file(), nodes[i], path, "initialization occurs twice", "remove one of them");
    }
    suite->initializations.push_back(initialization);
  }
}

std::vector<std::optional<std::int64_t>> ReadMatrix(const YamlMap& map, const std::string& key, std::int64_t low,
                                                    std::int64_t high) {
  std::vector<std::optional<std::int64_t>> values;
  const auto nodes = map.List(key);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    values.push_back(YamlInteger(nodes[i], map.file(), map.Path(key, i), low, high));
  }
  return values;
}

// Tables distinguish methods by name, multi-starts, sample size and collision model, so these must be unique.
void AddMethod(const nlohmann::json& map, const YAML::Node& node, const YamlMap& where, const SolverRegistry& registry,
               Suite* suite) {
  const std::string place = YamlPlace(where.file(), node);
  Method method = Method::FromJson(map, place, registry);
  for (const auto& other : suite->methods) {
    if (other.name == method.name && other.multi_starts == method.multi_starts &&
        other.sample_size_percent == method.sample_size_percent && other.collision == method.collision) {
      throw InputError({place, where.Path("name"), method.name,
                        "another method has the same name, multi_starts, sample_size and collision",
                        "give each method a name of its own, so that tables can tell them apart"});
    }
  }
  if (suite->methods.size() == limits::kMostMethods) {
    throw InputError({place, "methods", "",
                      "are more than " + std::to_string(limits::kMostMethods) + ", lists multiplied",
                      "make two suites of it"});
  }
  suite->methods.push_back(std::move(method));
}

// Collision models named by the suite or a method, one method for each. nullopt: use the options.
using Collision = std::optional<SceneRepresentation>;

std::vector<Collision> ReadCollisions(const YamlMap& map) {
  if (!map.Has("collision")) return {std::nullopt};
  std::vector<Collision> values;
  const auto nodes = map.List("collision");
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    values.emplace_back(ReadEnum<SceneRepresentation>(nodes[i], map.file(), map.Path("collision", i)));
  }
  return values;
}

// Reads the keys of a method that have a single value.
nlohmann::json ReadPlainKeys(const YamlMap& map) {
  auto base = nlohmann::json::object();
  base["solver"] = map.String("solver");
  if (map.Has("name")) base["name"] = map.Name("name");
  if (map.Has("incremental")) base["incremental"] = map.Boolean("incremental");
  if (map.Has("options")) {
    const YAML::Node options = map.Get("options");
    if (!options.IsMap() && !options.IsNull()) {
      throw YamlFault(map.file(), options, map.Path("options"), "must be a mapping of option names to values", "");
    }
    if (options.IsMap()) base["options"] = YamlToJson(options, map.file(), map.Path("options"));
  }
  return base;
}

// Returns the collision models of a method: the suite's, or else its own. They may be set in one place only.
std::vector<Collision> CollisionsOf(const YamlMap& map, const Collision& shared, const nlohmann::json& base) {
  const bool option = base.contains("options") && base["options"].contains("collision");
  if ((shared ? 1 : 0) + (map.Has("collision") ? 1 : 0) + (option ? 1 : 0) > 1) {
    throw InputError({YamlPlace(map.file(), map.node()), map.Path("collision"), "",
                      "is given more than once: by the suite, the method or its options", "keep one of them"});
  }
  return shared ? std::vector<Collision>{shared} : ReadCollisions(map);
}

/// Options of the suite, for all methods that do not set them.
struct SharedOptions {
  std::optional<PairSelection> pairs;
  std::optional<double> constraint_tolerance;  ///< only for solvers that have this option
};

SharedOptions ReadSharedOptions(const YamlMap& map) {
  constexpr double kSmallest = 1e-12, kLargest = 1e-3;
  SharedOptions shared{ReadPairs(map), {}};
  if (map.Has(kToleranceKey)) shared.constraint_tolerance = map.Number(kToleranceKey, kSmallest, kLargest);
  return shared;
}

// Returns whether the solver of a method has the option. Solvers that are unknown are refused later.
bool HasOption(const nlohmann::json& method, const std::string& option, const SolverRegistry& registry) {
  const auto solver = method.find("solver");
  if (solver == method.end() || !solver->is_string() || registry.Find(solver->get<std::string>()) == nullptr) {
    return false;
  }
  return Method::FromJson({{"solver", *solver}}, "", registry).ToJson()["options"].contains(option);
}

// Sets the suite's options of a method that does not set them. Options that are not a map are refused later.
void SetSharedOptions(const SharedOptions& shared, const SolverRegistry& registry, nlohmann::json* method) {
  if (!shared.pairs && !shared.constraint_tolerance) return;
  const bool has_tolerance = HasOption(*method, kToleranceKey, registry);
  nlohmann::json& options = method->emplace("options", nlohmann::json::object()).first.value();
  if (!options.is_object()) return;
  if (shared.pairs) options.emplace("pairs", ToString(*shared.pairs));
  if (shared.constraint_tolerance && has_tolerance) options.emplace(kToleranceKey, *shared.constraint_tolerance);
}

void ReadMethod(const YamlMap& map, const Collision& shared, const SharedOptions& options,
                const SolverRegistry& registry, Suite* suite) {
  nlohmann::json base = ReadPlainKeys(map);
  SetSharedOptions(options, registry, &base);
  std::vector<std::optional<std::int64_t>> multi_starts{std::nullopt}, sample_sizes{std::nullopt};
  if (map.Has("multi_starts")) multi_starts = ReadMatrix(map, "multi_starts", 0, limits::kMaxMultiStarts);
  if (map.Has("sample_size")) sample_sizes = ReadMatrix(map, "sample_size", 1, 100);
  for (const auto& collision : CollisionsOf(map, shared, base)) {
    for (const auto& starts : multi_starts) {
      for (const auto& size : sample_sizes) {
        auto method = base;
        if (starts) method["multi_starts"] = *starts;
        if (size) method["sample_size"] = *size;
        if (collision) method["options"]["collision"] = ToString(*collision);
        AddMethod(method, map.node(), map, registry, suite);
      }
    }
  }
}

void ReadMethods(const YamlMap& map, const SolverRegistry& registry, Suite* suite) {
  const auto nodes = map.List("methods");
  const SharedOptions options = ReadSharedOptions(map);
  for (const auto& collision : ReadCollisions(map)) {
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      ReadMethod(YamlMap(nodes[i], map.file(), map.Path("methods", i), kMethodKeys), collision, options, registry,
                 suite);
    }
  }
}

// Reads one number for all tasks, or a map with a number for each; missing tasks keep their values.
template <class Value, class Read>
void ReadTaskLimits(const YamlMap& parent, const std::string& key, const Read& read, EnumArray<Task, Value>* values) {
  if (!parent.Has(key)) return;
  if (!parent.Get(key).IsMap()) {
    values->values.fill(read(parent, key));
    return;
  }
  const YamlMap map(parent.Get(key), parent.file(), parent.Path(key), EnumNamesOf<Task>());
  for (const auto& [task, word] : kEnumNames<Task>) {
    if (map.Has(std::string(word))) (*values)[task] = read(map, std::string(word));
  }
}

void ReadLimits(const YamlMap& parent, Suite* suite) {
  const YamlMap map(parent.Get("limits"), parent.file(), parent.Path("limits"),
                    {"effort_limit", "wall_time_s", "memory_mb"});
  const auto evaluations = [](const YamlMap& limit, const std::string& key) {
    return limit.Integer(key, 1, limits::kMaxEffort);
  };
  const auto seconds = [](const YamlMap& limit, const std::string& key) {
    return limit.Number(key, limits::kMinWallTime_s, limits::kMaxWallTime_s);
  };
  ReadTaskLimits(map, "effort_limit", evaluations, &suite->effort_limit);
  ReadTaskLimits(map, "wall_time_s", seconds, &suite->wall_time_s);
  if (map.Has("memory_mb")) {
    suite->memory_mb = static_cast<int>(map.Integer("memory_mb", limits::kMinMemory_mb, limits::kMaxMemory_mb));
  }
}

std::string LowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

// Removes the items whose key is not in `wanted`; every wanted key must occur.
template <class Item, class Key>
void Keep(const std::vector<std::string>& wanted, const std::string& flag, const std::string& file,
          std::vector<Item>* items, Key key) {
  if (wanted.empty()) return;
  std::vector<std::string> present, keep;
  for (const auto& item : *items) {
    if (std::count(present.begin(), present.end(), key(item)) == 0) present.push_back(key(item));
  }
  for (const auto& want : wanted) {
    const bool known = std::any_of(present.begin(), present.end(),
                                   [&](const std::string& name) { return LowerCase(name) == LowerCase(want); });
    if (!known) throw InputError({file, flag, want, "is not in the suite", SuggestName(want, present)});
    keep.push_back(LowerCase(want));
  }
  std::erase_if(*items,
                [&](const Item& item) { return std::count(keep.begin(), keep.end(), LowerCase(key(item))) == 0; });
}

// Keeps the named methods; the mark of external solvers in tables is optional. `lists`: names separated by commas; a
// name may contain commas as well.
void KeepMethods(const std::vector<std::string>& lists, Suite* suite) {
  const auto has = [&](const std::string& name) {
    return std::any_of(suite->methods.begin(), suite->methods.end(),
                       [&](const Method& method) { return LowerCase(method.name) == LowerCase(name); });
  };
  const auto is_method = [&](const std::string& name) { return has(name) || has(name + kExternalMark); };
  std::vector<std::string> wanted;
  for (const std::string& list : lists) {
    for (const std::string& name : app::SplitValues(list, is_method)) {
      const bool marked = !has(name) && has(name + kExternalMark);
      wanted.push_back(marked ? name + kExternalMark : name);
    }
  }
  Keep(wanted, "--methods", suite->file, &suite->methods, [](const Method& method) { return method.name; });
}

// Keeps the wanted problems of every task. Each item, an id or a range, must select a problem of some task, and no task
// may lose all its problems.
void KeepProblems(const std::vector<std::string>& items, Suite* suite) {
  const auto wanted = ParseProblemIds(items, suite->file, "--problems");
  std::set<int> kept;
  for (auto& task : suite->tasks) {
    std::vector<int> both = wanted;
    if (task.problems) {
      both.clear();
      std::set_intersection(wanted.begin(), wanted.end(), task.problems->begin(), task.problems->end(),
                            std::back_inserter(both));
    }
    if (both.empty()) {
      throw InputError({suite->file, "--problems", "",
                        "leaves no problem of the task " + std::string(ToString(task.task)),
                        "choose among the problems that the suite names, or leave the task out with --tasks"});
    }
    kept.insert(both.begin(), both.end());
    task.problems = std::move(both);
  }
  for (const std::string& item : items) {
    const auto ids = ParseProblemIds({item}, suite->file, "--problems");
    if (std::any_of(ids.begin(), ids.end(), [&](int id) { return kept.count(id) > 0; })) continue;
    throw InputError({suite->file, "--problems", item, "names a problem of none of the suite's tasks",
                      "choose among the problems that the suite names"});
  }
}

}  // namespace

Suite ReadSuite(const std::filesystem::path& file, const SolverRegistry& registry) {
  std::error_code error;
  if (std::filesystem::is_directory(file, error)) {
    throw InputError({file.string(), "", "", "is a folder, not an experiment file", "name a .yaml file in it"});
  }
  return ParseSuite(ReadFileText(file, kShortYaml.bytes), file.string(), registry);
}

Suite ParseSuite(const std::string& text, const std::string& file, const SolverRegistry& registry) {
  const YAML::Node root = ParseYaml(text, file, kShortYaml);
  const YamlMap map(root, file, "", kSuiteKeys);
  Suite suite;
  suite.file = file;
  // A pipe has neither a name nor a folder.
  const bool is_stream = files::IsStream(file);
  const auto stem = [&file] { return ToNfc(std::filesystem::path(file).stem().string()); };
  suite.name = map.Has("name") ? map.Name("name") : is_stream ? "stdin" : stem();
  if (map.Has("dataset")) {
    // Also correct for an absolute path: operator/ then drops the left side.
    const auto folder = is_stream ? std::filesystem::path() : std::filesystem::path(file).parent_path();
    suite.dataset = (folder / map.String("dataset")).lexically_normal();
  }
  if (map.Has("seed")) suite.seed = map.Integer("seed", 0, std::numeric_limits<std::int64_t>::max());
  if (map.Has("repetitions"))
    suite.repetitions = static_cast<int>(map.Integer("repetitions", 1, limits::kMaxRepetitions));
  ReadTasks(map, &suite);
  if (map.Has("initializations")) ReadInitializations(map, &suite);
  ReadMethods(map, registry, &suite);
  if (map.Has("max_stances"))
    suite.max_stances = static_cast<int>(map.Integer("max_stances", 2, limits::kMaxWaypoints));
  if (map.Has("limits")) ReadLimits(map, &suite);
  if (map.Has("max_attempts"))
    suite.max_attempts = static_cast<int>(map.Integer("max_attempts", 1, limits::kMostAttempts));
  if (map.Has("split")) suite.split = ReadSplit(map);
  if (map.Has("rule")) suite.rule = ReadRule(map);
  if (map.Has("builds")) suite.builds = ReadBuildRule(map);
  return suite;
}

void ApplyFilter(const SuiteFilter& filter, Suite* suite) {
  KeepMethods(filter.methods, suite);
  Keep(filter.collision, "--collision", suite->file, &suite->methods,
       [](const Method& method) { return std::string(ToString(method.collision)); });
  Keep(filter.multi_starts, "--multi-starts", suite->file, &suite->methods,
       [](const Method& method) { return std::to_string(method.multi_starts); });
  Keep(filter.sample_sizes, "--sample-size", suite->file, &suite->methods,
       [](const Method& method) { return std::to_string(method.sample_size_percent); });
  Keep(filter.tasks, "--tasks", suite->file, &suite->tasks,
       [](const TaskSelection& task) { return std::string(ToString(task.task)); });
  Keep(filter.initializations, "--initializations", suite->file, &suite->initializations,
       [](Initialization initialization) { return std::string(ToString(initialization)); });
  if (!filter.problems.empty()) KeepProblems(filter.problems, suite);
  if (filter.seed) suite->seed = *filter.seed;
  if (filter.max_stances) suite->max_stances = filter.max_stances;
  if (filter.split) suite->split = *filter.split;
}

void AddNullRow(Suite* suite) {
  Method copy = suite->methods.front();
  copy.name += " (copy)";
  const auto same = [&](const Method& method) { return method.name == copy.name; };
  if (std::any_of(suite->methods.begin(), suite->methods.end(), same)) {
    throw InputError({suite->file, "methods", copy.name, "is the name that --null gives to its copy", "rename it"});
  }
  suite->methods.push_back(std::move(copy));
}

std::vector<int> ParseProblemIds(const std::vector<std::string>& items, const std::string& place,
                                 const std::string& field) {
  std::set<int> ids;
  for (const auto& item : items) {
    int first = 0;
    const char* end = item.data() + item.size();
    auto parsed = std::from_chars(item.data(), end, first);
    int last = first;
    if (parsed.ec == std::errc() && parsed.ptr != end && *parsed.ptr == '-') {
      parsed = std::from_chars(parsed.ptr + 1, end, last);
    }
    const bool good =
        parsed.ec == std::errc() && parsed.ptr == end && first >= 0 && first <= last && last <= kMaxProblemId;
    if (!good) {
      throw InputError({place, field, item, "is not a problem id or a range of ids", "write 3 or \"0-9\""});
    }
    for (int id = first; id <= last; ++id) ids.insert(id);
  }
  return {ids.begin(), ids.end()};
}

}  // namespace legopt::client
