#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "legopt/import/collada_robot.h"
#include "legopt/import/dataset_diagnostic.h"
#include "legopt/types/read_guard.h"

namespace legopt {

/// Name of the robot's file in a dataset folder.
inline constexpr const char* kRobotFileName = "robot.urdf";
/// Folder of the robot's meshes in a dataset folder.
inline constexpr const char* kRobotMeshFolder = "meshes";

/// Writes a robot as `folder`/robot.urdf and its meshes as binary PLY files in `folder`/meshes. Joints are written in
/// depth-first order, which preserves the order of degrees of freedom. Throws InputError if a file cannot be written.
void WriteColladaRobot(const ColladaRobot& robot, const std::filesystem::path& folder);

/// Copies a URDF to `folder`/robot.urdf and its collision meshes to `folder`/meshes, and updates their names in the
/// URDF; `package://` and absolute names become relative. Visual elements are removed, since they are not used. Returns
/// findings about removed parts. `guard`: see RobotModel::FromUrdfFile. Throws InputError like
/// RobotModel::FromUrdfFile, and for a file that cannot be copied.
std::vector<DatasetDiagnostic> CopyUrdfRobot(const std::filesystem::path& urdf, const std::filesystem::path& folder,
                                             const ReadGuard& guard);

}  // namespace legopt
