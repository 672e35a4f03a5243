#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "legopt/import/collada_robot.h"
#include "legopt/import/finding.h"
#include "legopt/read_guard.h"

namespace legopt {

/// Names inside of a dataset folder.
inline constexpr const char* kRobotFileName = "robot.urdf";
/// Folder of the robot's meshes, beside kRobotFileName.
inline constexpr const char* kRobotMeshFolder = "meshes";

/// Writes a robot as `folder`/robot.urdf, its meshes as binary PLY files in `folder`/meshes. Joints stand depth first,
/// so that they keep their order as degrees of freedom. Throws InputError when a file cannot be written.
void WriteColladaRobot(const ColladaRobot& robot, const std::filesystem::path& folder);

/// Copies a URDF to `folder`/robot.urdf and its collision meshes into `folder`/meshes, and rewrites their names in it;
/// `package://` and absolute names become relative. Visual elements go, since nothing here reads them. Returns findings
/// about what was left out. `guard` as for RobotModel::FromUrdfFile. Throws InputError: whatever that throws, or a file
/// that cannot be copied.
std::vector<DatasetFinding> CopyUrdfRobot(const std::filesystem::path& urdf, const std::filesystem::path& folder,
                                          const ReadGuard& guard);

}  // namespace legopt
