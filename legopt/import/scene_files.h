#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "legopt/import/dataset_diagnostic.h"
#include "legopt/types/read_guard.h"

namespace legopt {

/// A scene that was copied into a dataset folder.
struct CopiedScene {
  std::string file;                         ///< relative to the folder
  std::vector<DatasetDiagnostic> findings;  ///< changes that were made
};

/// Options of copying a scene.
struct SceneCopyOptions {
  std::filesystem::path root;  ///< findings contain paths relative to it
  bool fix_winding = false;    ///< flip bodies with inverted winding
  ReadGuard read_guard;        ///< runs the mesh parser
};

/// Copies a scene into `folder`: a mesh as scene.SUFFIX, or a scene.yaml and its meshes in a separate folder, so that
/// their names cannot clash with the robot's.
///
/// With `fix_winding`, a mesh with inverted bodies (mesh_faults.h) is rewritten with these flipped, as scene.ply, or as
/// NAME-turned.ply, which the copied scene.yaml then refers to; findings list this. Throws InputError like
/// ReadSceneFile and LoadMesh, for a mesh outside the scene's folder, and for a file that cannot be copied.
CopiedScene CopySceneFiles(const std::filesystem::path& scene, const std::filesystem::path& folder,
                           const SceneCopyOptions& options);

}  // namespace legopt
