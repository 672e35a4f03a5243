#include "legopt/dataset/content_hash.h"

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <system_error>

#include "legopt/dataset/contact_fields.h"
#include "legopt/dataset/scene_file.h"
#include "legopt/files/output_file.h"
#include "legopt/input/file_text.h"
#include "legopt/input/json.h"
#include "legopt/math/blake2b.h"
#include "legopt/types/input_error.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxBytesOfFile = std::size_t{4} << 30;
constexpr const char* kPlainCharacters =  // characters that need no quotes in YAML
    "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./-";

[[noreturn]] void Fail(const fs::path& path, std::string message, std::string fix) {
  throw InputError(
      {.file = path.string(), .field = "", .value = "", .message = std::move(message), .fix = std::move(fix)});
}

std::string RelativePath(const fs::path& folder, const std::string& mesh_file) {
  const fs::path relative = fs::path(mesh_file).lexically_normal().lexically_relative(folder.lexically_normal());
  if (relative.empty() || *relative.begin() == "..") {
    Fail(mesh_file, "the mesh lies outside the dataset folder " + folder.string(), "move it into the folder");
  }
  return relative.generic_string();
}

/// Returns `text` without its top-level `files:` block; `position` is the block's former position, or npos.
std::string RemoveFilesBlock(const std::string& text, size_t* position) {
  std::string kept;
  *position = std::string::npos;
  bool inside = false;
  for (size_t begin = 0; begin < text.size();) {
    const size_t newline = text.find('\n', begin);
    const size_t end = newline == std::string::npos ? text.size() : newline + 1;
    const std::string line = text.substr(begin, end - begin);
    const bool top_level = line.find_first_of(" \t\r\n#}") != 0;
    if (inside && top_level) inside = false;
    if (!inside && line.starts_with("files:")) {
      inside = true;
      *position = kept.size();
    }
    // An unindented comment ends the block: it belongs to the lines after it.
    if (inside && line.starts_with("#")) inside = false;
    if (!inside) kept += line;
    begin = end;
  }
  return kept;
}

std::string FormatFilesBlock(const std::vector<FileHash>& manifest) {
  std::string block = "files:\n";
  for (const FileHash& file : manifest) {
    const bool plain = file.path.find_first_not_of(kPlainCharacters) == std::string::npos;
    block += "  " + (plain ? file.path : Dump(nlohmann::json(file.path))) + ": " + file.hash + "\n";
  }
  return block;
}

}  // namespace

std::string HashFile(const fs::path& path) { return Blake2bHex(ReadFileText(path, kMaxBytesOfFile)); }

std::vector<std::string> ListUsedFiles(const fs::path& folder, const DatasetDescription& description,
                                       const RobotModel& robot, const Scene& scene) {
  std::vector<std::string> paths = {description.robot_file, description.scene_file};
  std::copy_if(description.problem_files.begin(), description.problem_files.end(), std::back_inserter(paths),
               [](const std::string& file) { return !file.empty(); });
  const auto add_mesh = [&](const ShapeSpec& shape) {
    if (shape.kind == ShapeSpec::Kind::kMesh) paths.push_back(RelativePath(folder, shape.mesh_file));
  };
  for (const Link& link : robot.links()) std::for_each(link.collision.begin(), link.collision.end(), add_mesh);
  for (const SceneObject& object : scene.objects) add_mesh(object.shape);
  std::sort(paths.begin(), paths.end());
  paths.erase(std::unique(paths.begin(), paths.end()), paths.end());
  return paths;
}

std::vector<FileHash> ComputeManifest(const fs::path& folder, const ReadGuard& guard) {
  const fs::path absolute = fs::weakly_canonical(folder);
  const DatasetDescription description = DescribeDataset(absolute);
  const RobotModel robot = RobotModel::FromUrdfFile((absolute / description.robot_file).string(), guard);
  const Scene scene = ReadSceneFile(absolute / description.scene_file, guard);
  std::vector<FileHash> manifest;
  for (const std::string& path : ListUsedFiles(absolute, description, robot, scene)) {
    manifest.push_back({.path = path, .hash = HashFile(absolute / path)});
  }
  return manifest;
}

std::vector<FileHash> WriteManifestHashes(const fs::path& folder, const ReadGuard& guard) {
  const fs::path path = folder / kDatasetFileName;
  if (!fs::exists(path))
    Fail(path, "does not exist", "a bare LegOpt folder has no manifest; write a dataset.yaml first");
  const std::string text = ReadFileText(path, kMaxBytesOfFile);
  const std::vector<FileHash> manifest = ComputeManifest(folder, guard);
  size_t position = 0;
  std::string kept = RemoveFilesBlock(text, &position);
  if (position == std::string::npos) {
    if (!kept.empty() && kept.back() != '\n') kept += '\n';
    position = kept.size();
  }
  kept.insert(position, FormatFilesBlock(manifest));
  WriteOutputFile(path, kept);
  return manifest;
}

std::string ContentHash(const DatasetDescription& description, const std::vector<FileHash>& manifest) {
  nlohmann::json text = {{"robot", description.robot_file},
                         {"scene", description.scene_file},
                         {"gravity_m_s2", description.gravity_m_s2},
                         {"nominal_posture", description.nominal_posture},
                         {"self_collision_reference", description.self_collision_reference},
                         {"files", nlohmann::json::object()}};
  if (const std::optional<double> sole_offset_m = CommonSoleOffset_m(description.contacts)) {
    text["format"] = kDatasetFormat1;
    text["sole_offset_m"] = *sole_offset_m;
    for (const ContactDescription& contact : description.contacts) text["feet"].push_back(contact.link);
  } else {
    text["format"] = kDatasetFormat2;
    text["contacts"] = CanonicalContacts(description.contacts);
  }
  for (const TaskDescription& row : ProblemTasks()) {
    text[std::string(ToString(row.task))] = description.problem_files[row.task];
  }
  for (const FileHash& file : manifest) text["files"][file.path] = file.hash;
  return Blake2bHex(Dump(text));
}

}  // namespace legopt
