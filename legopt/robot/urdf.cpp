// URDF files become RobotModels: the file is checked, urdfdom reads its elements, and the document's own order of
// joints gives the order of the tree.

#include <filesystem>

#include "legopt/robot/robot_model.h"
#include "legopt/robot/urdf_check.h"
#include "legopt/robot/urdf_tree.h"
#include "legopt/robot/urdfdom_reader.h"

namespace legopt {

RobotModel RobotModel::FromUrdfFile(const std::string& path) {
  return FromUrdfText(ReadUrdfFile(path), path, std::filesystem::path(path).parent_path().string());
}

RobotModel RobotModel::FromUrdfText(const std::string& xml, const std::string& source, const std::string& mesh_folder) {
  const CheckedUrdf urdf = CheckUrdf(xml, source);
  return BuildUrdfTree(urdf, ReadByIsolatedUrdfdom(urdf), mesh_folder);
}

}  // namespace legopt
