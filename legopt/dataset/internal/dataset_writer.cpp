#include "legopt/dataset/internal/dataset_writer.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <nlohmann/json.hpp>
#include <string_view>
#include <system_error>

#include "legopt/dataset/internal/self_collision_file.h"
#include "legopt/files/written_file.h"
#include "legopt/input/json.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;

void CopyMesh(const fs::path& source, const ShapeSpec& shape, const fs::path& folder) {
  if (shape.kind != ShapeSpec::Kind::kMesh) return;
  CopyOutputFile(shape.mesh_file, folder / fs::path(shape.mesh_file).lexically_relative(source));
}

/// Formats a number as the shortest text that parses to the same double.
std::string Number(double value) { return Dump(nlohmann::json(value)); }

/// Formats a text for YAML, quoted where needed.
std::string Text(const std::string& text) {
  static constexpr std::array<std::string_view, 9> kEnumNames = {"true", "false", "yes", "no", "on",
                                                                 "off",  "null",  "y",   "n"};
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  const auto inside = [&](char c) { return letter(c) || (c >= '0' && c <= '9') || c == '-' || c == '.' || c == '/'; };
  const bool plain = !text.empty() && letter(text.front()) && std::all_of(text.begin(), text.end(), inside);
  const bool word = std::any_of(kEnumNames.begin(), kEnumNames.end(), [&](std::string_view w) {
    return std::equal(w.begin(), w.end(), text.begin(), text.end(),
                      [](char a, char b) { return a == std::tolower(static_cast<unsigned char>(b)); });
  });
  return plain && !word ? text : Dump(nlohmann::json(text));
}

void AddMap(const char* key, const std::map<std::string, double>& values, std::string& text) {
  if (values.empty()) return;
  text += std::string("\n") + key + ":\n";
  for (const auto& [name, value] : values) text += "  " + Text(name) + ": " + Number(value) + "\n";
}

std::string FormatSoles(const std::vector<ContactDescription>& contacts, double sole_offset_m) {
  std::string feet;
  for (const ContactDescription& contact : contacts) feet += (feet.empty() ? "" : ", ") + Text(contact.link);
  return "\nfeet: [" + feet + "]\nsole_offset_m: " + Number(sole_offset_m) + "\n";
}

std::string Vector(const Eigen::Vector3d& vector) {
  return "[" + Number(vector.x()) + ", " + Number(vector.y()) + ", " + Number(vector.z()) + "]";
}

std::string FormatContacts(const std::vector<ContactDescription>& contacts) {
  std::string text = "\ncontacts:\n";
  for (const ContactDescription& contact : contacts) {
    text += "  " + Text(contact.name) + ":\n    link: " + Text(contact.link) +
            "\n    kind: " + std::string(ToString(contact.kind)) +
            "\n    frame: {position: " + Vector(contact.position) + ", rpy: " + Vector(contact.rpy_rad) + "}\n";
    if (contact.points) {
      std::string points;
      for (const Eigen::Vector3d& point : *contact.points) points += (points.empty() ? "" : ", ") + Vector(point);
      text += "    points: [" + points + "]\n";
    }
    const ContactKindDescription& facts = DescriptionOf(contact.kind);
    if (HasRadius(facts.shape)) text += "    radius_m: " + Number(contact.radius_m) + "\n";
    if (facts.slides) text += "    slide_m: " + Number(contact.slide_m) + "\n";
    if (facts.forces == ContactForces::kBounded) {
      text += "    max_force_N: " + Number(contact.max_force_N) + "\n";
      continue;
    }
    text += "    friction: " + Number(contact.friction) + "\n";
    if (contact.max_normal_N) text += "    max_normal_N: " + Number(*contact.max_normal_N) + "\n";
  }
  return text;
}

}  // namespace

std::string FormatProblems(std::span<const ProblemDefinition> problems, Task task, const std::string& robot,
                           const std::string& scenario) {
  const auto quoted = [](const std::string& text) { return Dump(nlohmann::json(text)); };
  std::string text = "{\"robot\": " + quoted(robot) + ", \"scenario\": " + quoted(scenario) + ", \"task\": \"" +
                     std::string(ToString(task)) + "\",\n \"problems\": [";
  bool first = true;
  for (const ProblemDefinition& problem : problems) {
    text += (first ? "\n" : ",\n") + std::string("  {\"id\": ") + std::to_string(problem.id) + ", \"definition\": [";
    first = false;
    for (size_t s = 0; s < problem.stances.size(); ++s) {
      text += (s == 0 ? "" : ",\n   ") + Dump(StanceJson(problem.stances[s]));
    }
    text += "]}";
  }
  return text + "]}\n";
}

std::string FormatDatasetFile(const DatasetDescription& description, const std::string& comment) {
  std::string text;
  ClassicInput lines(comment);
  for (std::string line; std::getline(lines, line);) text += "# " + line + "\n";
  const bool only_format_2 = !description.support.empty() || !description.effort_limits.empty() ||
                             !description.velocity_limits.empty() || description.self_collision.has_value() ||
                             !description.trunk.empty() || description.link_shapes != LinkRepresentation::kHulls;
  const std::optional<double> sole_offset_m = only_format_2 ? std::nullopt : CommonSoleOffset_m(description.contacts);
  text += std::string("format: ") + (sole_offset_m ? kDatasetFormat1 : kDatasetFormat2) +
          "\nname: " + Text(description.name) + "\nrobot: " + Text(description.robot_file) +
          "\nscene: " + Text(description.scene_file) + "\nproblems:\n";
  for (const TaskDescription& row : ProblemTasks()) {
    const std::string& file = description.problem_files[row.task];
    if (!file.empty()) text += "  " + std::string(ToString(row.task)) + ": " + Text(file) + "\n";
  }
  text += sole_offset_m ? FormatSoles(description.contacts, *sole_offset_m) : FormatContacts(description.contacts);
  if (!description.support.empty()) {
    std::string names;
    for (const std::string& name : description.support) names += (names.empty() ? "" : ", ") + Text(name);
    text += "support: [" + names + "]\n";
  }
  if (!description.trunk.empty()) text += "trunk: " + Text(description.trunk) + "\n";
  text += "gravity_m_s2: " + Number(description.gravity_m_s2) + "\n";
  AddMap("effort_limits", description.effort_limits, text);
  AddMap("velocity_limits", description.velocity_limits, text);
  AddMap("nominal_posture", description.nominal_posture, text);
  AddMap("self_collision_reference", description.self_collision_reference, text);
  if (description.link_shapes != LinkRepresentation::kHulls) {
    text += "link_shapes: " + std::string(ToString(description.link_shapes)) + "\n";
  }
  if (description.self_collision) text += FormatSelfCollision(*description.self_collision, Text);
  return text + "\n";
}

void CopyRobot(const Dataset& source, const DatasetDescription& description, const fs::path& folder) {
  CopyOutputFile(source.folder() / description.robot_file, folder / description.robot_file);
  for (const Link& link : source.robot().links()) {
    for (const ShapeSpec& shape : link.collision) CopyMesh(source.folder(), shape, folder);
  }
}

void CopyScene(const Dataset& source, const DatasetDescription& description, const fs::path& folder) {
  CopyOutputFile(source.folder() / description.scene_file, folder / description.scene_file);
  for (const SceneObject& object : source.scene().objects) CopyMesh(source.folder(), object.shape, folder);
}

}  // namespace legopt
