#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "legopt/import/finding.h"
#include "legopt/read_guard.h"

namespace legopt {

/// A scene as it stands in a dataset folder.
struct CopiedScene {
  std::string file;                      ///< relative to the folder
  std::vector<DatasetFinding> findings;  ///< about what was changed; empty when nothing was
};

/// How a scene is copied.
struct SceneCopyOptions {
  std::filesystem::path root;  ///< findings name files relative to it
  bool fix_winding = false;    ///< turn bodies that are inside out
  ReadGuard read_guard;        ///< runs the reader of meshes
};

/// Copies a scene into `folder`: a mesh as scene.SUFFIX, or a scene.yaml and its meshes into a folder of their own, so
/// that they cannot meet the robot's.
///
/// With `fix_winding` a mesh with bodies inside out (mesh_faults.h) is written anew with them turned round, as
/// scene.ply or as NAME-turned.ply, which the copied scene.yaml then names; findings tell. Throws InputError:
/// whatever ReadSceneFile and LoadMesh throw, a mesh outside of the scene's folder, a file that cannot be copied.
CopiedScene CopySceneFiles(const std::filesystem::path& scene, const std::filesystem::path& folder,
                           const SceneCopyOptions& options);

}  // namespace legopt
