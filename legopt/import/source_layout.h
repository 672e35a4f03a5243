#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "words/task.h"

namespace legopt {

/// What the user names; everything else is looked for. A path that does not exist is tried inside of the folder.
struct SourceChoices {
  std::optional<std::string> robot;                     ///< .urdf, .dae or .zae
  std::optional<std::string> scene;                     ///< a mesh or a scene.yaml
  Per<Task, std::optional<std::string>> problems = {};  ///< LegOpt JSON
};

/// The files that a dataset is made from; absolute paths.
struct SourceLayout {
  std::filesystem::path robot;                ///< URDF or COLLADA
  bool collada = false;                       ///< the robot is a COLLADA file
  std::filesystem::path scene;                ///< a mesh or a scene.yaml
  Per<Task, std::filesystem::path> problems;  ///< empty: none
};

/// Finds robot, scene and problems in a folder (hidden folders are not searched):
///
/// * what its dataset.yaml names, if there is one; else
/// * robot: the only .urdf, else the only .zae or .dae with kinematics, at any depth;
/// * scene: what the OpenRAVE environment `*.xml` names in `<Render>`, as in a clone of the original benchmark; else
///   scene.yaml; else the only mesh directly in the folder that is no robot;
/// * problems: `problems*.json` at any depth, one per task; the key `task` tells which, or the number of stances.
///
/// Throws InputError naming what is missing or ambiguous, the candidates, and the flag that decides.
SourceLayout FindSources(const std::filesystem::path& folder, const SourceChoices& choices);

}  // namespace legopt
