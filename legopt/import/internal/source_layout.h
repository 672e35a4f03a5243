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
  std::filesystem::path folder;  ///< the source, or the folder of the robot's file
  std::filesystem::path robot;   ///< URDF or COLLADA
  bool collada = false;
  std::filesystem::path scene;                      ///< a mesh or a scene.yaml; empty: none
  EnumArray<Task, std::filesystem::path> problems;  ///< empty: no problems of this task
};

/// Finds robot, scene and problems. A robot's file as `source` has the scene and the problems that are selected, and no
/// others. A folder is searched, without hidden folders:
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
