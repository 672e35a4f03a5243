#pragma once

#include <map>
#include <string>
#include <vector>

#include "legopt/geometry/mesh.h"
#include "legopt/import/collada_document.h"
#include "legopt/import/collada_robot.h"

namespace legopt {

/// The nodes of a COLLADA robot's visual scene and their meshes. Internal to this module.
class ColladaScene {
 public:
  /// `link_names`: a node with one of these names belongs to that link; other nodes belong to the link above them.
  /// Poses are relative to the parent of the node of `base`. Throws InputError: no visual scene, no node for the base.
  ColladaScene(const ColladaDocument& document, const std::vector<std::string>& link_names, const std::string& base);

  /// Returns the geometry of a link. `link`: pose of the link's frame in the base frame with all joints zero.
  std::vector<ColladaGeometry> GeometryOf(const std::string& name, const Eigen::Isometry3d& link) const;

 private:
  struct Instance {
    const tinyxml2::XMLElement* geometry = nullptr;
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< relative to the visual scene
  };
  void Visit(const tinyxml2::XMLElement& node, const Eigen::Isometry3d& parent, const std::string& owner);
  TriangleMesh MeshOf(const tinyxml2::XMLElement& geometry) const;

  const ColladaDocument& document_;
  std::map<std::string, const tinyxml2::XMLElement*> geometries_;  ///< keyed by id
  std::map<std::string, std::vector<Instance>> instances_;         ///< keyed by link
  Eigen::Isometry3d base_ = Eigen::Isometry3d::Identity();         ///< pose of the robot in the visual scene
  std::string base_name_;
  bool base_found_ = false;
};

}  // namespace legopt
