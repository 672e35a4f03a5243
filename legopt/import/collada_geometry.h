#pragma once

#include <map>
#include <string>
#include <vector>

#include "legopt/collision/mesh.h"
#include "legopt/import/collada_document.h"
#include "legopt/import/collada_robot.h"

namespace legopt {

/// The nodes of a COLLADA robot's visual scene and their meshes. Internal to the room.
class ColladaScene {
 public:
  /// `link_names`: a node of such a name is that link's; other nodes belong to the link above them. Positions are
  /// relative to what the node of `base` stands in. Throws InputError: no visual scene, no node for the base.
  ColladaScene(const ColladaDocument& document, const std::vector<std::string>& link_names, const std::string& base);

  /// Geometry of a link, placed in the frame with pose `link` in the base frame, all joints zero.
  std::vector<ColladaGeometry> GeometryOf(const std::string& name, const Eigen::Isometry3d& link) const;

 private:
  struct Instance {
    const tinyxml2::XMLElement* geometry = nullptr;
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< in the visual scene
  };
  void Visit(const tinyxml2::XMLElement& node, const Eigen::Isometry3d& parent, const std::string& owner);
  TriangleMesh MeshOf(const tinyxml2::XMLElement& geometry) const;

  const ColladaDocument& document_;
  std::map<std::string, const tinyxml2::XMLElement*> geometries_;  ///< by id
  std::map<std::string, std::vector<Instance>> instances_;         ///< by link
  Eigen::Isometry3d base_ = Eigen::Isometry3d::Identity();         ///< of the robot in the visual scene
  std::string base_name_;
  bool base_found_ = false;
};

}  // namespace legopt
