#include "legopt/generate/dataset_writer.h"

#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <sstream>
#include <system_error>

#include "legopt/input_error.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;

void Copy(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::create_directories(to.parent_path(), error);
  fs::copy_file(from, to, fs::copy_options::overwrite_existing, error);
  if (error) {
    throw InputError({from.string(), "", "", "cannot be copied to " + to.string() + ": " + error.message(),
                      "check permissions and free space"});
  }
}

void CopyMesh(const fs::path& source, const ShapeSpec& shape, const fs::path& folder) {
  if (shape.kind != ShapeSpec::Kind::kMesh) return;
  Copy(shape.mesh_file, folder / fs::path(shape.mesh_file).lexically_relative(source));
}

/// Shortest text that reads back as the same number.
std::string Number(double value) { return nlohmann::json(value).dump(); }

void AddMap(const char* key, const std::map<std::string, double>& values, std::string& text) {
  if (values.empty()) return;
  text += std::string("\n") + key + ":\n";
  for (const auto& [name, value] : values) text += "  " + name + ": " + Number(value) + "\n";
}

}  // namespace

std::string FormatProblems(std::span<const ProblemDefinition> problems, Task task, const std::string& robot,
                           const std::string& scenario) {
  const auto quoted = [](const std::string& text) { return nlohmann::json(text).dump(); };
  std::string text = "{\"robot\": " + quoted(robot) + ", \"scenario\": " + quoted(scenario) + ", \"task\": \"" +
                     std::string(ToString(task)) + "\",\n \"problems\": [";
  bool first = true;
  for (const ProblemDefinition& problem : problems) {
    text += (first ? "\n" : ",\n") + std::string("  {\"id\": ") + std::to_string(problem.id) + ", \"definition\": [";
    first = false;
    for (size_t s = 0; s < problem.stances.size(); ++s) {
      text += (s == 0 ? "" : ",\n   ") + quoted(FormatStance(problem.stances[s]));
    }
    text += "]}";
  }
  return text + "]}\n";
}

std::string FormatDatasetFile(const DatasetDescription& description, const std::string& comment) {
  std::string text;
  std::istringstream lines(comment);
  for (std::string line; std::getline(lines, line);) text += "# " + line + "\n";
  text += std::string("format: ") + kDatasetFormat + "\nname: " + description.name +
          "\nrobot: " + description.robot_file + "\nscene: " + description.scene_file + "\nproblems:\n";
  if (!description.posture_file.empty()) text += "  posture: " + description.posture_file + "\n";
  if (!description.motion_file.empty()) text += "  motion: " + description.motion_file + "\n";
  std::string feet;
  for (const std::string& foot : description.feet) feet += (feet.empty() ? "" : ", ") + foot;
  text += "\nfeet: [" + feet + "]\nsole_offset_m: " + Number(description.sole_offset_m) +
          "\ngravity_m_s2: " + Number(description.gravity_m_s2) + "\n";
  AddMap("nominal_posture", description.nominal_posture, text);
  AddMap("self_collision_reference", description.self_collision_reference, text);
  return text + "\n";
}

void CopyRobot(const Dataset& source, const DatasetDescription& description, const fs::path& folder) {
  Copy(source.folder() / description.robot_file, folder / description.robot_file);
  for (const Link& link : source.robot().links()) {
    for (const ShapeSpec& shape : link.collision) CopyMesh(source.folder(), shape, folder);
  }
}

void CopyScene(const Dataset& source, const DatasetDescription& description, const fs::path& folder) {
  Copy(source.folder() / description.scene_file, folder / description.scene_file);
  for (const SceneObject& object : source.scene().objects) CopyMesh(source.folder(), object.shape, folder);
}

}  // namespace legopt
