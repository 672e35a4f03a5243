#include "legopt/judge/solution_file.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "legopt/dataset/problem_definition.h"
#include "legopt/files/written_file.h"
#include "legopt/input/json.h"
#include "legopt/input/text.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

using Json = nlohmann::json;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr const char* kSpace = " \t\r\n,";

/// Location of a value, for messages.
struct Place {
  std::string file;
  std::string field;

  Place Inner(const std::string& part) const { return {file, field + ", " + part}; }
};

[[noreturn]] void Fail(const Place& place, std::string value, std::string message, std::string fix) {
  throw InputError({.file = place.file,
                    .field = place.field,
                    .value = std::move(value),
                    .message = std::move(message),
                    .fix = std::move(fix)});
}

bool HasDigit(std::string_view text) { return text.find_first_of("0123456789") != std::string_view::npos; }

/// Returns true for a number beyond the range of double: "1e400", but not "inf". `value`: result of ParseNumber.
bool Overflows(std::string_view token, std::optional<double> value) {
  return value && std::isinf(*value) && HasDigit(token);
}

/// Returns true for a word that denotes a number, but that the JSON grammar or parser would reject.
bool IsNonJsonNumber(std::string_view word) {
  return word == "NaN" || word == "Infinity" || word == "-Infinity" || word == "nan" || word == "inf" ||
         word == "-inf" || (HasDigit(word) && Overflows(word, ParseNumber(word)));
}

/// Converts such words outside strings to strings.
std::string QuoteNonJsonNumbers(std::string_view json) {
  const auto in_word = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '+' || c == '.';
  };
  std::string text;
  text.reserve(json.size());
  for (size_t i = 0; i < json.size();) {
    size_t end = i + 1;
    bool quote = false;
    if (json[i] == '"') {
      while (end < json.size() && json[end] != '"') end += json[end] == '\\' ? 2 : 1;
      end = std::min(end + 1, json.size());
    } else if (in_word(json[i])) {
      while (end < json.size() && in_word(json[end])) ++end;
      quote = IsNonJsonNumber(json.substr(i, end - i));
    }
    if (quote) text += '"';
    text += json.substr(i, end - i);
    if (quote) text += '"';
    i = end;
  }
  return text;
}

std::string Shortened(const std::string& text) {
  constexpr size_t kMost = 40;
  return text.size() <= kMost ? text : text.substr(0, kMost) + "...";
}

Eigen::VectorXd ToVector(const std::vector<double>& values) {
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

/// Reads the waypoints of one solution. Unreadable numbers become NaN (infinite), and the first one is recorded.
class WaypointReader {
 public:
  explicit WaypointReader(Solution* solution) : solution_(*solution) {}

  void Read(const Json& entry) {
    values_.clear();
    if (entry.is_array()) {
      for (const Json& number : entry) values_.push_back(Element(number));
    } else if (entry.is_string()) {
      const std::string_view text = entry.get_ref<const std::string&>();
      for (size_t begin = text.find_first_not_of(kSpace); begin != std::string_view::npos;) {
        const size_t end = std::min(text.find_first_of(kSpace, begin), text.size());
        values_.push_back(Number(text.substr(begin, end - begin)));
        begin = text.find_first_not_of(kSpace, end);
      }
    } else {
      Note(-1, Dump(entry), "neither a text of numbers nor a list");
    }
    solution_.waypoints.push_back(ToVector(values_));
  }

 private:
  double Element(const Json& entry) {
    if (entry.is_number()) return entry.get<double>();
    if (entry.is_null()) return kNan;
    if (entry.is_string() && IsNonJsonNumber(entry.get_ref<const std::string&>())) {
      return Number(entry.get_ref<const std::string&>());
    }
    Note(static_cast<int>(values_.size()), entry.is_string() ? entry.get<std::string>() : Dump(entry), "not a number");
    return kNan;
  }

  double Number(std::string_view token) {
    const std::optional<double> value = ParseNumber(token);
    if (!value || Overflows(token, value)) {
      Note(static_cast<int>(values_.size()), std::string(token), value ? "which no double holds" : "not a number");
    }
    return value.value_or(kNan);
  }

  void Note(int index, const std::string& value, const char* message) {
    if (solution_.unreadable) return;
    solution_.unreadable = {.waypoint = static_cast<int>(solution_.waypoints.size()),
                            .index = index,
                            .value = Shortened(value),
                            .message = message};
  }

  Solution& solution_;
  std::vector<double> values_;  ///< numbers of the current waypoint
};

const Json& Require(const Json& object, const char* key, const Place& place) {
  const auto entry = object.find(key);
  if (entry == object.end()) Fail(place.Inner(key), "", "the key is missing", "add it (LegOpt solution format)");
  return *entry;
}

Solution ParseSolution(const Json& entry, const Place& place) {
  if (!entry.is_object()) Fail(place, Dump(entry), "must be an object", "write {\"method\": ..., \"x\": [...]}");
  Solution solution;
  const Json& method = Require(entry, "method", place);
  if (!method.is_string()) Fail(place.Inner("method"), Dump(method), "must be a text", "write the method's name");
  solution.method = method.get<std::string>();
  if (solution.method.empty()) Fail(place.Inner("method"), "", "must not be empty", "write the method's name");
  const Place named{place.file, place.field + " (method '" + solution.method + "')"};
  if (!entry.contains("timeSec")) {
    Fail(named.Inner("timeSec"), "", "the key is missing", "write seconds, or null when it was not measured");
  }
  const Json& time = entry["timeSec"];
  if (!time.is_number() && !time.is_null()) {
    Fail(named.Inner("timeSec"), Dump(time), "must be a number", "write seconds, or null when it was not measured");
  }
  solution.time_s = time.is_null() ? kNan : time.get<double>();
  if (solution.time_s < 0.0) {
    Fail(named.Inner("timeSec"), Dump(time), "must not be negative", "write seconds, or null when it was not measured");
  }
  const Json& x = Require(entry, "x", named);
  if (!x.is_array()) Fail(named.Inner("x"), Dump(x), "must be a list of waypoints", "write one text per waypoint");
  WaypointReader reader(&solution);
  for (const Json& waypoint : x) reader.Read(waypoint);
  if (const auto success = entry.find("success"); success != entry.end() && success->is_boolean()) {
    solution.success = success->get<bool>();
  }
  if (const auto init = entry.find("initType"); init != entry.end() && init->is_string()) {
    solution.init_type = init->get<std::string>();
  }
  return solution;
}

std::vector<Solution> ParseSolutions(const Json& problem, const Place& place) {
  std::vector<Solution> solutions;
  const auto list = problem.find("solution");
  if (list == problem.end()) return solutions;
  if (!list->is_array()) Fail(place.Inner("solution"), "", "must be a list", "write \"solution\": [{...}]");
  std::set<std::string> methods;
  for (size_t i = 0; i < list->size(); ++i) {
    const Place inner = place.Inner("solution " + std::to_string(i));
    solutions.push_back(ParseSolution((*list)[i], inner));
    if (!methods.insert(solutions.back().method).second) {
      Fail(inner, solutions.back().method, "the method has two solutions of one problem", "rename or remove one");
    }
  }
  return solutions;
}

std::vector<std::string> ParseJoints(const Json& root, const std::string& file) {
  const auto list = root.find("joints");
  if (list == root.end()) return {};
  const Place place{file, "joints"};
  const auto is_text = [](const Json& name) { return name.is_string(); };
  if (!list->is_array() || list->empty() || !std::all_of(list->begin(), list->end(), is_text)) {
    Fail(place, Shortened(Dump(*list)), "must be a list of names",
         "name the joints in the order of x, without the base");
  }
  return list->get<std::vector<std::string>>();
}

std::string FormatWaypoint(const Eigen::VectorXd& x) {
  std::string text;
  for (const double value : x) {
    if (!text.empty()) text += '\n';
    text += FormatNumber(value);
  }
  return text;
}

Json FormatSolution(const Solution& solution) {
  Json entry = {{"method", solution.method}, {"x", Json::array()}};
  entry["timeSec"] = std::isfinite(solution.time_s) ? Json(solution.time_s) : Json(nullptr);
  for (const Eigen::VectorXd& x : solution.waypoints) entry["x"].push_back(FormatWaypoint(x));
  if (solution.success) entry["success"] = *solution.success;
  if (!solution.init_type.empty()) entry["initType"] = solution.init_type;
  if (solution.unsolved) {
    Json& window =
        entry["unsolvedWindow"] = {{"firstWaypoint", solution.unsolved->first_waypoint}, {"x", Json::array()}};
    for (const Eigen::VectorXd& x : solution.unsolved->waypoints) window["x"].push_back(FormatWaypoint(x));
  }
  return entry;
}

}  // namespace

std::string UnreadableNumber::Describe() const {
  const std::string number = index < 0 ? " is " : ": number " + std::to_string(index) + " is ";
  return "waypoint " + std::to_string(waypoint) + number + "'" + value + "', " + message;
}

SolutionFile ReadSolutions(const std::filesystem::path& path) {
  const Json root = ParseJson(QuoteNonJsonNumbers(ReadFileText(path, JsonLimits{}.bytes)), path.string());
  ProblemFile problems = ParseProblemFile(root, path.string(), true);
  SolutionFile file{.robot = problems.robot,
                    .scenario = problems.scenario,
                    .task = TaskOf(problems),
                    .problems = {},
                    .joints = ParseJoints(root, path.string()),
                    .path = path.string()};
  const Json& list = root["problems"];
  for (size_t i = 0; i < list.size(); ++i) {
    ProblemDefinition& definition = problems.problems[i];
    const Place place{path.string(), "problem " + std::to_string(definition.id)};
    file.problems.push_back({.definition = std::move(definition), .solutions = ParseSolutions(list[i], place)});
  }
  return file;
}

std::string FormatSolutions(const SolutionFile& file) {
  Json root = {{"robot", file.robot}, {"scenario", file.scenario}, {"task", ToString(file.task)}};
  if (!file.joints.empty()) root["joints"] = file.joints;
  if (!file.origins.empty()) root["origins"] = file.origins;
  root["problems"] = Json::array();
  for (const SolvedProblem& problem : file.problems) {
    Json entry = {{"id", problem.definition.id}, {"solution", Json::array()}};
    for (const Stance& stance : problem.definition.stances) entry["definition"].push_back(StanceJson(stance));
    for (const Solution& solution : problem.solutions) entry["solution"].push_back(FormatSolution(solution));
    root["problems"].push_back(std::move(entry));
  }
  return Dump(root, 1) + '\n';
}

void WriteSolutions(const std::filesystem::path& path, const SolutionFile& file) {
  WriteOutputFile(path, FormatSolutions(file));
}

}  // namespace legopt
