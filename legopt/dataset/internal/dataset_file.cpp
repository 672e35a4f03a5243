#include "legopt/dataset/internal/dataset_file.h"

#include <algorithm>
#include <filesystem>
#include <numbers>
#include <vector>

#include "legopt/dataset/internal/contact_file.h"
#include "legopt/dataset/internal/self_collision_file.h"
#include "legopt/dataset/internal/yaml_fields.h"
#include "legopt/dataset/scene_file.h"
#include "legopt/input/text.h"
#include "legopt/input/yaml.h"
#include "legopt/types/input_error.h"
#include "legopt/types/nearest_name.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;

/// Returns a relative path in normal form; throws if it leaves the folder.
std::string CheckPath(const YamlFields& fields, const std::string& key, const std::string& text) {
  const fs::path path = fs::path(text).lexically_normal();
  if (text.empty() || path.is_absolute() || *path.begin() == "..") {
    fields.Fail(key, text, "the path leaves the dataset's folder", "move the file into it and write a relative path");
  }
  return path.generic_string();
}

std::map<std::string, double> ReadJointValues(const YamlFields& fields, const std::string& key) {
  std::map<std::string, double> values;
  const YAML::Node map = fields.Get(key);
  if (!map.IsDefined() || map.IsNull()) return values;
  if (!map.IsMap()) fields.Fail(key, DescribeNode(map), "must map joint names to values", "write 'joint: 0.5' lines");
  for (const auto& entry : map) {
    const std::string joint = DescribeNode(entry.first);
    const std::optional<double> value = AsNumber(entry.second);
    if (!value) {
      fields.Fail(key + "." + joint, DescribeNode(entry.second), "must be a finite number", "write radians or metres");
    }
    if (!values.emplace(joint, *value).second) fields.Fail(key + "." + joint, "", "given twice", "keep one of them");
  }
  return values;
}

/// Reads limits of joints, which must be greater than 0.
std::map<std::string, double> ReadJointLimits(const YamlFields& fields, const std::string& key) {
  std::map<std::string, double> limits = ReadJointValues(fields, key);
  for (const auto& [joint, limit] : limits) {
    if (limit > 0.0) continue;
    fields.Fail(key + "." + joint, FormatNumber(limit), "must be greater than 0",
                "write the joint's limit, or remove the line to keep the URDF's");
  }
  return limits;
}

/// Reads the names of the contacts on which plans walk.
std::vector<std::string> ReadSupport(const YamlFields& fields, const std::vector<ContactDescription>& contacts) {
  const YAML::Node list = fields.Get("support");
  if (!list.IsDefined() || list.IsNull()) return {};
  const std::string fix = "list names of contacts of kind sole or point";
  if (!list.IsSequence() || list.size() == 0) {
    fields.Fail("support", DescribeNode(list), "must list at least one contact", fix);
  }
  std::vector<std::string> support;
  for (const YAML::Node& node : list) {
    const std::string name = DescribeNode(node);
    const auto found = std::ranges::find(contacts, name, &ContactDescription::name);
    if (found == contacts.end()) {
      std::vector<std::string> names;
      for (const ContactDescription& contact : contacts) names.push_back(contact.name);
      fields.Fail("support", name, "is no contact of this dataset", SuggestName(name, names));
    }
    if (!DescriptionOf(found->kind).supports) {
      fields.Fail("support", name, "is of kind '" + std::string(ToString(found->kind)) + "', on which no plan walks",
                  fix);
    }
    if (std::ranges::find(support, name) != support.end()) {
      fields.Fail("support", name, "the contact is listed twice", "list it once");
    }
    support.push_back(name);
  }
  return support;
}

std::map<std::string, std::string> ReadFiles(const YamlFields& fields) {
  std::map<std::string, std::string> files;
  const YAML::Node map = fields.Get("files");
  if (!map.IsDefined() || map.IsNull()) return files;
  if (!map.IsMap()) fields.Fail("files", DescribeNode(map), "must map paths to hashes", "write 'path: hash' lines");
  for (const auto& entry : map) {
    const std::string path = DescribeNode(entry.first);
    if (!files.emplace(CheckPath(fields, "files." + path, path), DescribeNode(entry.second)).second) {
      fields.Fail("files." + path, "", "the file is listed twice", "keep one line");
    }
  }
  return files;
}

/// Joins a text of every task as "a or b" for errors.
template <typename TextOf>
std::string AnyTask(const TextOf& text_of) {
  std::string text;
  for (const TaskDescription& task : ProblemTasks()) text += (text.empty() ? "" : " or ") + std::string(text_of(task));
  return text;
}

void ReadProblemNames(const YamlFields& fields, DatasetDescription* description) {
  std::vector<std::string> words;
  for (const TaskDescription& row : ProblemTasks()) words.emplace_back(ToString(row.task));
  const YamlFields problems(fields.Require("problems"), fields.file(), "problems", words);
  bool any = false;
  for (const TaskDescription& row : ProblemTasks()) {
    const std::string key(ToString(row.task));
    const std::optional<std::string> text = problems.Text(key);
    if (text) description->problem_files[row.task] = CheckPath(problems, key, *text);
    any = any || text.has_value();
  }
  if (any) return;
  fields.Fail("problems", "", "names no problem file", "add " + AnyTask([](const TaskDescription& task) {
                                                         return "'" + std::string(ToString(task.task)) + ": FILE.json'";
                                                       }));
}

/// Returns the value of `format`, which decides which other keys are valid.
std::string ReadFormat(const YAML::Node& root, const std::string& file) {
  std::vector<std::string> keys;
  if (root.IsMap()) {
    for (const auto& entry : root) keys.push_back(DescribeNode(entry.first));
  }
  const YamlFields fields(root, file, "", keys);
  const std::string format = fields.RequireText("format");
  if (format != kDatasetFormat1 && format != kDatasetFormat2) {
    fields.Fail("format", format, "unknown dataset format",
                "this program reads '" + std::string(kDatasetFormat1) + "' and '" + kDatasetFormat2 + "'");
  }
  return format;
}

}  // namespace

std::string DatasetDescription::PathOf(const ContactDescription& contact) const {
  return CommonSoleOffset_m(contacts) ? "feet" : "contacts." + contact.name + ".link";
}

DatasetDescription ReadDatasetFile(const fs::path& folder) {
  const std::string file = (folder / kDatasetFileName).string();
  const YAML::Node root = ReadYamlFile(file);
  const bool has_soles = ReadFormat(root, file) == kDatasetFormat1;
  std::vector<std::string> keys = {"format",   "name",         "robot",           "scene",
                                   "problems", "gravity_m_s2", "nominal_posture", "self_collision_reference",
                                   "files"};
  for (const char* key : has_soles ? std::vector{"feet", "sole_offset_m"}
                                   : std::vector{"contacts", "support", "effort_limits", "velocity_limits", "trunk",
                                                 "self_collision", "link_shapes"})
    keys.push_back(key);
  const YamlFields fields(root, file, "", keys);
  DatasetDescription description;
  description.name = fields.RequireText("name");
  RequireName(description.name, file, "name");
  description.robot_file = CheckPath(fields, "robot", fields.RequireText("robot"));
  description.scene_file = CheckPath(fields, "scene", fields.RequireText("scene"));
  ReadProblemNames(fields, &description);
  description.contacts = has_soles ? ReadSoles(fields) : ReadContacts(fields);
  description.support = ReadSupport(fields, description.contacts);
  description.effort_limits = ReadJointLimits(fields, "effort_limits");
  description.velocity_limits = ReadJointLimits(fields, "velocity_limits");
  description.trunk = fields.Text("trunk").value_or("");
  description.gravity_m_s2 = fields.Number("gravity_m_s2").value_or(DatasetDescription::kBenchmarkGravity_m_s2);
  if (!(description.gravity_m_s2 > 0)) {
    fields.Fail("gravity_m_s2", FormatNumber(description.gravity_m_s2), "must be greater than 0", "write 9.81");
  }
  description.nominal_posture = ReadJointValues(fields, "nominal_posture");
  description.self_collision_reference = ReadJointValues(fields, "self_collision_reference");
  description.self_collision = ReadSelfCollision(fields);
  description.link_shapes = ReadLinkShapes(fields);
  description.files = ReadFiles(fields);
  return description;
}

DatasetDescription DescribeDataset(const fs::path& folder) {
  if (fs::is_regular_file(folder / kDatasetFileName)) return ReadDatasetFile(folder);
  if (IsLegOptFolder(folder)) return DescribeLegOptFolder(folder);
  throw InputError({.file = folder.string(),
                    .field = "",
                    .value = "",
                    .message = fs::is_directory(folder) ? "is not a dataset folder" : "the folder does not exist",
                    .fix = "name a folder with dataset.yaml, or one with " +
                           AnyTask([](const TaskDescription& task) { return task.legopt_problem_file; }) +
                           ", one URDF and one scene mesh"});
}

namespace {

constexpr double kAtlasSoleOffset_m = 0.082351;  // lowest vertex of r_foot (0.081351) plus the tolerance (0.001)
constexpr double kKnee_rad = 50 * std::numbers::pi / 180;
constexpr double kHipAndAnkle_rad = -25 * std::numbers::pi / 180;
constexpr double kShoulder_rad = 1.3;
constexpr double kReferenceBack_rad = 20 * 3.1415 / 180;  // the original evaluator's approximation of pi

/// Returns the only element, as a path relative to the folder; throws for none or several.
std::string TheOnly(const fs::path& folder, std::vector<fs::path> found, const std::string& what) {
  std::sort(found.begin(), found.end());
  if (found.size() == 1) return found.front().lexically_relative(folder).generic_string();
  std::string names;
  for (const fs::path& path : found) names += (names.empty() ? "" : ", ") + path.lexically_relative(folder).string();
  throw InputError({.file = folder.string(),
                    .field = what,
                    .value = names,
                    .message = found.empty() ? "a LegOpt-style folder needs one, there is none" : "there are several",
                    .fix = "keep exactly one, or write a dataset.yaml that names it"});
}

}  // namespace

bool IsLegOptFolder(const fs::path& folder) {
  return std::ranges::any_of(ProblemTasks(), [&](const TaskDescription& task) {
    return fs::is_regular_file(folder / task.legopt_problem_file);
  });
}

DatasetDescription DescribeLegOptFolder(const fs::path& folder) {
  DatasetDescription description;
  description.bare = true;
  const fs::path absolute = fs::weakly_canonical(folder);
  description.name = absolute.filename().string();
  std::vector<fs::path> robots;
  for (const auto& entry : fs::recursive_directory_iterator(absolute)) {
    if (entry.is_regular_file() && entry.path().extension() == ".urdf") robots.push_back(entry.path());
  }
  std::vector<fs::path> meshes;
  for (const auto& entry : fs::directory_iterator(absolute)) {
    if (entry.is_regular_file() && IsMeshFile(entry.path())) meshes.push_back(entry.path());
  }
  description.robot_file = TheOnly(absolute, robots, "URDF file (*.urdf)");
  description.scene_file = TheOnly(absolute, meshes, "scene mesh (.stl, .obj, .dae, .ply)");
  for (const TaskDescription& task : ProblemTasks()) {
    if (!fs::is_regular_file(absolute / task.legopt_problem_file)) continue;
    description.problem_files[task.task] = task.legopt_problem_file;
  }
  SetBenchmarkConstants(&description);
  return description;
}

void SetBenchmarkConstants(DatasetDescription* description) {
  description->contacts = DescribeSoles({"l_foot", "r_foot"}, kAtlasSoleOffset_m);
  description->nominal_posture = {{"l_leg_kny", kKnee_rad},        {"r_leg_kny", kKnee_rad},
                                  {"l_leg_lhy", kHipAndAnkle_rad}, {"r_leg_lhy", kHipAndAnkle_rad},
                                  {"l_leg_uay", kHipAndAnkle_rad}, {"r_leg_uay", kHipAndAnkle_rad},
                                  {"l_arm_shx", -kShoulder_rad},   {"r_arm_shx", kShoulder_rad}};
  description->self_collision_reference = {{"back_lbz", kReferenceBack_rad}, {"back_ubx", kReferenceBack_rad}};
}

}  // namespace legopt
