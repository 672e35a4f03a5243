#pragma once

#include <string>
#include <vector>

#include "legopt/robot/robot_model.h"
#include "legopt/types/read_guard.h"

namespace legopt {

/// One fixed obstacle.
struct SceneObject {
  std::string name;  ///< label in messages; unique when read from a file
  ShapeSpec shape;   ///< shape and its pose in the world
};

/// All obstacles of the environment. Nothing is loaded or checked until a model is built.
struct Scene {
  std::vector<SceneObject> objects;  ///< ordered as in the file
  ReadGuard read_guard = {};         ///< guard that was used to read the scene; its meshes are loaded with it
};

}  // namespace legopt
