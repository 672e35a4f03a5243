#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "legopt/import/internal/collada_robot.h"
#include "legopt/import/internal/dataset_diagnostic.h"
#include "legopt/robot/internal/mesh_lookup.h"
#include "legopt/types/read_guard.h"

namespace legopt {

/// Name of the robot's file in a dataset folder.
inline constexpr const char* kRobotFileName = "robot.urdf";
/// Folder of the robot's meshes in a dataset folder.
inline constexpr const char* kRobotMeshFolder = "meshes";

/// Makes a folder and those above it. Throws InputError if that fails.
void MakeFolder(const std::filesystem::path& folder);

/// Writes a robot as `folder`/robot.urdf and its meshes as binary PLY files in `folder`/meshes. Joints are written in
/// depth-first order, which preserves the order of degrees of freedom. Throws InputError if a file cannot be written.
void WriteColladaRobot(const ColladaRobot& robot, const std::filesystem::path& folder);

/// Options of copying a robot.
struct RobotCopyOptions {
  bool visuals = false;       ///< links without collision geometry get their visual geometry
  bool repair = true;         ///< repair the meshes (link_mesh_repair.h)
  double mesh_scale = 1.0;    ///< factor for all collision meshes, > 0
  MeshSearch meshes = {};     ///< how mesh files are found
  ReadGuard read_guard = {};  ///< runs the mesh parser
};

/// Writes what is read of a URDF (urdf_check.h) to `folder`/robot.urdf, repaired, and its collision meshes to
/// `folder`/meshes. Meshes that need repair are written as PLY files, others copied; meshes without triangles are left
/// out. Returns findings about repairs and about parts that are not used. Throws InputError like
/// RobotModel::FromUrdfFile and LoadMesh, and for a file that cannot be copied.
std::vector<DatasetDiagnostic> CopyUrdfRobot(const std::filesystem::path& urdf, const std::filesystem::path& folder,
                                             const RobotCopyOptions& options);

}  // namespace legopt
