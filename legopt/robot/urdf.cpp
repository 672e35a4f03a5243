// Conversion of URDF files to RobotModels: the file is checked, urdfdom reads its elements, and the joint order of the
// document gives the order of the tree.

#include <filesystem>

#include "legopt/robot/robot_model.h"
#include "legopt/robot/urdf_check.h"
#include "legopt/robot/urdf_tree.h"
#include "legopt/robot/urdfdom_reader.h"

namespace legopt {

RobotModel RobotModel::FromUrdfFile(const std::string& path, const ReadGuard& guard) {
  return FromUrdfText(ReadUrdfFile(path), path, std::filesystem::path(path).parent_path().string(), guard);
}

RobotModel RobotModel::FromUrdfText(const std::string& xml, const std::string& source, const std::string& mesh_folder,
                                    const ReadGuard& guard) {
  const CheckedUrdf urdf = CheckUrdf(xml, source);
  RobotModel robot = BuildUrdfTree(urdf, ReadByUrdfdom(urdf), mesh_folder);
  robot.read_guard_ = guard;
  return robot;
}

}  // namespace legopt
