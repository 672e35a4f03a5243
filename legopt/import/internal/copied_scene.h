#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "legopt/import/internal/dataset_diagnostic.h"
#include "legopt/import/scene_repair.h"
#include "legopt/types/read_guard.h"

namespace legopt {

/// A scene that was copied into a dataset folder.
struct CopiedScene {
  std::string file;                         ///< relative to the folder
  std::vector<RebuiltObject> objects;       ///< objects of a scene that was rebuilt; else empty
  std::vector<DatasetDiagnostic> findings;  ///< changes that were made
};

/// Options of copying a scene.
struct SceneCopyOptions {
  std::filesystem::path root;  ///< findings contain paths relative to it
  SceneRepairOptions repair;   ///< changes that the user asked for
  ReadGuard read_guard;        ///< runs the mesh parser
};

/// Copies a scene into `folder`: a mesh as scene.SUFFIX, or a scene.yaml and its meshes in a separate folder, so that
/// their names cannot clash with the robot's.
///
/// A mesh with faults that can be repaired without a new surface (mesh_repair.h, `close` false) is rewritten, as
/// scene.ply, or as NAME-turned.ply, which the copied scene.yaml then refers to; findings list this. A mesh that is
/// closed, wound outwards and without duplicates is copied as it is. With options that change the scene, and for
/// formats that may refer to other files (glTF), the scene is rebuilt (scene_repair.h). Throws InputError like
/// ReadSceneFile and LoadMesh, for a mesh outside the scene's folder, and for a file that cannot be copied.
CopiedScene CopySceneFiles(const std::filesystem::path& scene, const std::filesystem::path& folder,
                           const SceneCopyOptions& options);

}  // namespace legopt
