#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "legopt/geometry/internal/mesh_repair.h"
#include "legopt/geometry/scene.h"
#include "legopt/import/internal/dataset_diagnostic.h"
#include "legopt/types/read_guard.h"

namespace legopt {

/// Changes to a scene that is rebuilt.
struct SceneRepairOptions {
  bool repair = false;               ///< repair meshes (mesh_repair.h)
  MeshRepairOptions mesh = {};       ///< options of the repair
  std::optional<double> scale = {};  ///< factor for all lengths; default: 1
  std::string up = {};               ///< axis of a mesh file that points up, "y" or "z"; empty: that of the file
  ReadGuard read_guard = {};         ///< runs the parsers

  bool any() const { return repair || scale || !up.empty(); }  ///< true if the scene must be rebuilt

  /// Throws InputError with the flag that is out of range.
  void Validate() const;
};

/// One object of a rebuilt scene.
struct RebuiltObject {
  SceneObject object;                ///< object with its new size and pose; for meshes, only the name
  std::optional<RepairedMesh> mesh;  ///< world frame, m; of mesh objects
};

/// A scene in metres with z up, whose meshes are in the world frame.
struct RebuiltScene {
  std::vector<RebuiltObject> objects;
  std::vector<DatasetDiagnostic> notes;  ///< objects that were turned, scaled or omitted

  MeshRepairCounts Counts() const;  ///< sum over all objects
  double Volume_m3() const;         ///< sum over all objects, as if they did not overlap
};

/// Reads a scene (scene_file.h, or a Gazebo world, sdf_world.h) and applies the options. Throws InputError like its
/// readers, and for options out of range.
RebuiltScene RebuildScene(const std::filesystem::path& path, const SceneRepairOptions& options);

/// Returns a finding for each mesh of a rebuilt scene that still has faults: the judge's triangles would not bound
/// solids.
std::vector<DatasetDiagnostic> FaultsOf(const RebuiltScene& scene);

/// Writes a scene.yaml and its meshes as PLY files into `mesh_folder`, which is relative to the file's folder. Throws
/// InputError if a file cannot be written.
void WriteSceneYaml(const RebuiltScene& scene, const std::filesystem::path& file, const std::string& mesh_folder);

/// Writes all objects as one PLY file. Throws InputError if it cannot be written.
void WriteSceneMesh(const RebuiltScene& scene, const std::filesystem::path& file);

}  // namespace legopt
