#pragma once

#include <string>
#include <vector>

#include "legopt/read_guard.h"
#include "legopt/robot/robot_model.h"

namespace legopt {

/// One fixed obstacle. The pose of `shape` is in the world frame.
struct SceneObject {
  std::string name;  ///< for messages; unique when read from a file
  ShapeSpec shape;   ///< what it is and where it stands
};

/// All obstacles of the environment. A plain value; nothing is loaded or checked before a model is built from it.
struct Scene {
  std::vector<SceneObject> objects;  ///< in the order of the file
  ReadGuard read_guard = {};         ///< with which the scene was read; its meshes are loaded under it
};

}  // namespace legopt
