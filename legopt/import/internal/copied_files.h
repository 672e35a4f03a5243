#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "legopt/import/internal/collada_robot.h"
#include "legopt/import/internal/dataset_diagnostic.h"
#include "legopt/import/scene_repair.h"
#include "legopt/types/read_guard.h"

namespace legopt {

/// Name of the robot's file in a dataset folder.
inline constexpr const char* kRobotFileName = "robot.urdf";
/// Folder of the robot's meshes in a dataset folder.
inline constexpr const char* kRobotMeshFolder = "meshes";

/// Returns the roll, pitch and yaw, rad, of a rotation Rz(yaw) Ry(pitch) Rx(roll), as URDF writes them.
Eigen::Vector3d RollPitchYaw(const Eigen::Matrix3d& R);

/// Writes a robot as `folder`/robot.urdf and its meshes as binary PLY files in `folder`/meshes. Joints are written in
/// depth-first order, which preserves the order of degrees of freedom. Throws InputError if a file cannot be written.
void WriteColladaRobot(const ColladaRobot& robot, const std::filesystem::path& folder);

/// Options of copying a robot.
struct RobotCopyOptions {
  bool visuals = false;       ///< links without collision geometry get their visual geometry
  bool repair = true;         ///< repair the meshes (link_mesh_repair.h)
  double mesh_scale = 1.0;    ///< factor for all collision meshes, > 0
  ReadGuard read_guard = {};  ///< runs the mesh parser
};

/// Writes what is read of a URDF (urdf_check.h) to `folder`/robot.urdf, repaired, and its collision meshes to
/// `folder`/meshes. Meshes that need repair are written as PLY files, others copied; meshes without triangles are left
/// out. Returns findings about repairs and about parts that are not used. Throws InputError like
/// RobotModel::FromUrdfFile and LoadMesh, and for a file that cannot be copied.
std::vector<DatasetDiagnostic> CopyUrdfRobot(const std::filesystem::path& urdf, const std::filesystem::path& folder,
                                             const RobotCopyOptions& options);

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
