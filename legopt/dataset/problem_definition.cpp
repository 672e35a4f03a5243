#include "legopt/dataset/problem_definition.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "legopt/input/json.h"
#include "legopt/types/input_error.h"
#include "legopt/types/nearest_name.h"
#include "legopt/types/number_text.h"
#include "legopt/types/task.h"

namespace legopt {
namespace {

constexpr std::string_view kSpace = " \t\r\n";
constexpr size_t kPoseSize = 7;

std::string_view Trim(std::string_view text) {
  const size_t first = text.find_first_not_of(kSpace);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kSpace) - first + 1);
}

/// Splits a text at commas and drops the empty field after a trailing comma.
std::vector<std::string_view> SplitFields(std::string_view text) {
  std::vector<std::string_view> fields;
  while (true) {
    const size_t comma = text.find(',');
    fields.push_back(Trim(text.substr(0, comma)));
    if (comma == std::string_view::npos) break;
    text.remove_prefix(comma + 1);
  }
  if (fields.back().empty()) fields.pop_back();
  return fields;
}

[[noreturn]] void Fail(const TextSource& source, std::string_view value, std::string message, std::string fix) {
  throw InputError({.file = source.file,
                    .field = source.field,
                    .value = std::string(value),
                    .message = std::move(message),
                    .fix = std::move(fix)});
}

double ReadPoseNumber(std::string_view token, const TextSource& source) {
  const std::string_view digits = token.starts_with('+') ? token.substr(1) : token;
  double value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || end != digits.data() + digits.size()) {
    Fail(source, token, "not a number in a pose", "a pose is 7 numbers: qw qx qy qz px py pz");
  }
  if (!std::isfinite(value)) Fail(source, token, "a pose must be finite", "replace the value by a finite number");
  return value;
}

ContactTarget ParseContactTarget(std::string_view contact, std::string_view pose, const TextSource& source) {
  std::array<double, kPoseSize> numbers{};
  size_t count = 0;
  for (size_t begin = pose.find_first_not_of(kSpace); begin != std::string_view::npos;) {
    const size_t end = std::min(pose.find_first_of(kSpace, begin), pose.size());
    if (count < kPoseSize) numbers[count] = ReadPoseNumber(pose.substr(begin, end - begin), source);
    ++count;
    begin = pose.find_first_not_of(kSpace, end);
  }
  if (count != kPoseSize) {
    Fail(source, pose,
         "the pose of '" + std::string(contact) + "' has " + std::to_string(count) + " numbers instead of 7",
         "write qw qx qy qz px py pz");
  }
  ContactTarget target{.contact = std::string(contact),
                       .position = {numbers[4], numbers[5], numbers[6]},
                       .rotation = Eigen::Quaterniond(numbers[0], numbers[1], numbers[2], numbers[3])};
  const double norm = target.rotation.norm();
  if (!(std::abs(norm - 1) <= kQuaternionTolerance)) {
    Fail(source, pose,
         "the quaternion of '" + std::string(contact) + "' is not unit: its norm is " + FormatNumber(norm) +
             ", which is more than " + FormatNumber(kQuaternionTolerance) + " from 1",
         "the first four numbers are qw qx qy qz; divide them by the norm");
  }
  return target;
}

}  // namespace

bool Stance::only_poses() const {
  return !push_N && std::ranges::all_of(contacts, [](const ContactTarget& target) { return target.only_pose(); });
}

bool HaveSamePose(const ContactTarget& a, const ContactTarget& b) {
  return a.contact == b.contact && a.position == b.position && a.rotation.coeffs() == b.rotation.coeffs();
}

bool operator==(const ContactTarget& a, const ContactTarget& b) {
  return HaveSamePose(a, b) && a.friction == b.friction && a.slide_m == b.slide_m && a.carries == b.carries;
}

bool operator==(const Stance& a, const Stance& b) { return a.contacts == b.contacts && a.push_N == b.push_N; }

bool operator==(const ProblemDefinition& a, const ProblemDefinition& b) {
  return a.id == b.id && a.stances == b.stances;
}

bool Fits(Task task, const ProblemDefinition& problem) {
  return HasStances(task, static_cast<int>(problem.stances.size()));
}

std::string DescribeStanceCounts() {
  std::string text;
  for (const TaskDescription& description : ProblemTasks()) {
    text += (text.empty() ? "a " : ", a ") + std::string(ToString(description.task)) + " problem " +
            (text.empty() ? "has " : "") + std::string(description.stances);
  }
  return text;
}

Stance ParseStance(std::string_view text, const TextSource& source) {
  const std::vector<std::string_view> fields = SplitFields(text);
  if (fields.empty()) {
    Fail(source, "\"" + std::string(text) + "\"", "the stance has no contacts",
         "write 'contact,qw qx qy qz px py pz,'");
  }
  if (fields.size() % 2 != 0) {
    Fail(source, text, "the stance does not alternate names of contacts and poses",
         "write 'contact,qw qx qy qz px py pz,'");
  }
  Stance stance;
  for (size_t i = 0; i < fields.size(); i += 2) {
    if (fields[i].empty())
      Fail(source, text, "the name of a contact is empty", "write 'contact,qw qx qy qz px py pz,'");
    for (const ContactTarget& earlier : stance.contacts) {
      if (earlier.contact == fields[i]) {
        Fail(source, fields[i], "a foot is listed twice in one stance", "keep one pose per foot");
      }
    }
    stance.contacts.push_back(ParseContactTarget(fields[i], fields[i + 1], source));
  }
  return stance;
}

namespace {

using Json = nlohmann::json;

/// Returns the contact of a stance that a key names.
ContactTarget& NamedTarget(Stance& stance, const std::string& name, const TextSource& source) {
  const auto found = std::ranges::find(stance.contacts, name, &ContactTarget::contact);
  if (found != stance.contacts.end()) return *found;
  std::vector<std::string> names;
  for (const ContactTarget& target : stance.contacts) names.push_back(target.contact);
  Fail(source, name, "the stance has no such contact", SuggestName(name, names));
}

double ReadStanceNumber(const Json& value, const TextSource& source) {
  const double number = value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
  if (!std::isfinite(number)) Fail(source, Dump(value), "must be a finite number", "write a number in SI units");
  return number;
}

void SetProperty(const std::string& key, const Json& value, const TextSource& source, ContactTarget& target) {
  if (key == "load") {
    if (value != "touch" && value != "carry") {
      Fail(source, Dump(value), "is no kind of load", "write \"touch\" or \"carry\"");
    }
    target.carries = value == "carry";
    return;
  }
  const double number = ReadStanceNumber(value, source);
  if (key == "friction") {
    if (!IsFriction(number)) Fail(source, Dump(value), "must lie in (0, 2]", "typical values: 0.4 to 0.8");
    target.friction = number;
  } else {
    constexpr double kLargest_m = 1.0;
    if (!(number >= 0.0 && number <= kLargest_m)) {
      Fail(source, Dump(value), "must lie in [0, 1]", "write a distance in metres");
    }
    target.slide_m = number;
  }
}

}  // namespace

Stance ReadStance(const Json& json, const TextSource& source) {
  if (json.is_string()) return ParseStance(json.get_ref<const std::string&>(), source);
  static const std::vector<std::string> kKeys = {"contacts", "friction", "load", "slide_m", "push_N"};
  if (!json.is_object() || !json.contains("contacts") || !json["contacts"].is_string()) {
    Fail(source, Dump(json), "must be a text, or an object with the text 'contacts'",
         "write 'contact,qw qx qy qz px py pz,'");
  }
  Stance stance = ParseStance(json["contacts"].get_ref<const std::string&>(), source);
  for (const auto& [key, value] : json.items()) {
    const TextSource place{.file = source.file, .field = source.field + ", " + key};
    if (key == "contacts") continue;
    if (std::ranges::find(kKeys, key) == kKeys.end()) Fail(place, "", "unknown key", SuggestName(key, kKeys));
    if (key == "push_N") {
      stance.push_N = ReadStanceNumber(value, place);
      if (!(*stance.push_N > 0.0)) Fail(place, Dump(value), "must be greater than 0", "leave it out for no push");
      continue;
    }
    if (!value.is_object()) Fail(place, Dump(value), "must map contacts to values", "write {\"l_palm\": ...}");
    for (const auto& [name, entry] : value.items()) {
      SetProperty(key, entry, {.file = place.file, .field = place.field + "." + name},
                  NamedTarget(stance, name, place));
    }
  }
  if (std::ranges::none_of(stance.contacts, &ContactTarget::carries)) {
    Fail({.file = source.file, .field = source.field + ", load"}, Dump(json["load"]), "no contact carries the robot",
         "leave one of them out");
  }
  return stance;
}

Json StanceJson(const Stance& stance) {
  const std::string poses = FormatStance(stance);
  if (stance.only_poses()) return poses;
  Json json = {{"contacts", poses}};
  for (const ContactTarget& target : stance.contacts) {
    if (target.friction) json["friction"][target.contact] = *target.friction;
    if (target.slide_m) json["slide_m"][target.contact] = *target.slide_m;
    if (!target.carries) json["load"][target.contact] = "touch";
  }
  if (stance.push_N) json["push_N"] = *stance.push_N;
  return json;
}

std::string FormatStance(const Stance& stance) {
  std::string text;
  for (const ContactTarget& target : stance.contacts) {
    text += target.contact + ",";
    const Eigen::Quaterniond& q = target.rotation;
    for (const double value : {q.w(), q.x(), q.y(), q.z()}) text += FormatNumber(value) + ' ';
    for (const double value : target.position) text += FormatNumber(value) + ' ';
    text += ",";
  }
  return text;
}

std::string StanceKey(const Stance& stance) {
  return stance.only_poses() ? FormatStance(stance) : Dump(StanceJson(stance));
}

namespace {

[[noreturn]] void FailProblem(const std::string& file, std::string field, std::string value, std::string message,
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
  if (!entry->is_string()) FailProblem(file, key, Dump(*entry), "must be a text", "write a JSON string");
  return entry->get<std::string>();
}

int ParseId(const Json& problem, size_t index, const std::string& file) {
  const std::string field = "problems[" + std::to_string(index) + "].id";
  const auto entry = problem.find("id");
  if (entry == problem.end()) FailProblem(file, field, "", "the key is missing", "give every problem an integer id");
  constexpr std::int64_t kMaxId = 1'000'000'000;
  if (!entry->is_number_integer() || *entry < 0 || *entry > kMaxId) {
    FailProblem(file, field, Dump(*entry), "must be an integer that is not negative",
                "number the problems 0, 1, 2, ...");
  }
  return entry->get<int>();
}

std::vector<Stance> ParseDefinition(const Json& definition, int id, const std::string& file) {
  const std::string place = "problem " + std::to_string(id);
  if (!definition.is_array() || definition.empty()) {
    FailProblem(file, place + ", definition", Dump(definition), "must be a list of at least one stance",
                "write [\"contact,qw qx qy qz px py pz,\"]");
  }
  std::vector<Stance> stances;
  stances.reserve(definition.size());
  for (size_t s = 0; s < definition.size(); ++s) {
    const std::string field = place + ", stance " + std::to_string(s);
    stances.push_back(ReadStance(definition[s], {.file = file, .field = field}));
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
  if (!root.is_object())
    FailProblem(file_for_errors, "", "", "the root must be a JSON object", "write {\"problems\": [...]}");
  const auto list = root.find("problems");
  if (list == root.end() || !list->is_array()) {
    FailProblem(file_for_errors, "problems", "", "the list of problems is missing", "write {\"problems\": [...]}");
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
    if (!entry.is_object())
      FailProblem(file_for_errors, field, Dump(entry), "must be an object", "write {\"id\": ...}");
    ProblemDefinition problem{.id = ParseId(entry, i, file_for_errors), .stances = {}};
    if (!ids.insert(problem.id).second) {
      FailProblem(file_for_errors, field + ".id", std::to_string(problem.id), "the id is used twice",
                  "renumber one of them");
    }
    const auto definition = entry.find("definition");
    if (definition != entry.end()) {
      problem.stances = ParseDefinition(*definition, problem.id, file_for_errors);
    } else if (!definition_optional) {
      FailProblem(file_for_errors, field + ".definition", "", "the key is missing", "add the list of stance strings");
    }
    file.problems.push_back(std::move(problem));
  }
  return file;
}

}  // namespace legopt
