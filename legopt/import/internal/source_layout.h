#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "legopt/types/task.h"

namespace legopt {

/// Files selected by the user; others are searched for. A path that does not exist is tried relative to the folder.
struct SourceChoices {
  std::optional<std::string> robot;                           ///< .urdf, .dae or .zae
  std::optional<std::string> scene;                           ///< a mesh or a scene.yaml
  EnumArray<Task, std::optional<std::string>> problems = {};  ///< LegOpt JSON
};

/// Source files of a dataset; absolute paths.
struct SourceLayout {
  std::filesystem::path folder;  ///< that of the source, or in which the robot's file is
  std::filesystem::path robot;  ///< URDF or COLLADA
  bool collada = false;
  std::filesystem::path scene;                      ///< a mesh or a scene.yaml; empty: none
  EnumArray<Task, std::filesystem::path> problems;  ///< empty: no problems of this task
};

/// Finds robot, scene and problems. If `source` is a robot's file, only those that are selected; else in that folder
/// (hidden folders are not searched):
///
/// * if there is a dataset.yaml, the files that it lists; else
/// * robot: the only .urdf, else the only .zae or .dae with kinematics, at any depth;
/// * scene: the mesh in `<Render>` of the OpenRAVE environment `*.xml`, as in a clone of the original benchmark; else
///   scene.yaml; else the only mesh directly in the folder that is neither a robot nor named by it; else none;
/// * problems: `problems*.json` at any depth, one per task, identified by the key `task` or the number of stances.
///
/// Throws InputError with the missing or ambiguous file, the candidates, and the flag to select one.
SourceLayout FindSources(const std::filesystem::path& source, const SourceChoices& choices);

}  // namespace legopt
