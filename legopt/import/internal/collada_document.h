#pragma once

#include <tinyxml2.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "legopt/geometry/internal/mesh.h"
#include "legopt/import/internal/collada_robot.h"

namespace legopt {

/// A COLLADA file as XML, with helpers for reading elements. Internal to this module.
///
/// A `.dae` is read directly; a `.zae` (a zip archive) must contain exactly one `.dae`. Every error is an InputError
/// with the file and the line in the document.
class ColladaDocument {
 public:
  /// Throws InputError: missing file, not an archive, several documents in it, not XML, no `<COLLADA>` element, an up
  /// axis other than z, a unit that is not positive.
  explicit ColladaDocument(const std::filesystem::path& path);

  /// Element `<COLLADA>`; lives as long as the document.
  const tinyxml2::XMLElement& root() const { return *document_.RootElement(); }
  /// Metres per unit of length of the document.
  double unit_m() const { return unit_m_; }
  std::string file() const { return path_.string(); }  ///< path, for messages

  /// Returns all elements of this name below `root` (not nested in each other), in the order of the document.
  static std::vector<const tinyxml2::XMLElement*> FindAll(const tinyxml2::XMLElement& root, const char* name);
  /// Returns the first element of this name below `root`, or null.
  static const tinyxml2::XMLElement* FindFirst(const tinyxml2::XMLElement& root, const char* name);

  /// Returns the value of an attribute. Throws if it is missing or empty.
  std::string Attribute(const tinyxml2::XMLElement& element, const char* name) const;
  /// Returns the element's text as finite numbers separated by white space. Throws unless there are `count` of them
  /// (-1: any number).
  std::vector<double> Numbers(const tinyxml2::XMLElement& element, int count) const;
  /// Returns the number in `<name>` of the parent, optionally wrapped in `<float>`; `fallback` if there is none.
  double Number(const tinyxml2::XMLElement& parent, const char* name, double fallback) const;
  /// Returns the truth value in `<name>` of the parent, optionally wrapped in `<bool>`; `fallback` if there is none.
  bool Flag(const tinyxml2::XMLElement& parent, const char* name, bool fallback) const;
  /// Returns the product of the `<translate>`, `<rotate>` (degrees) and `<matrix>` children in their order; lengths in
  /// metres.
  Eigen::Isometry3d Transform(const tinyxml2::XMLElement& element) const;

  /// Throws an InputError with the file and the line of the element.
  [[noreturn]] void Fail(const tinyxml2::XMLElement& element, const std::string& value, const std::string& message,
                         const std::string& fix) const;

 private:
  std::filesystem::path path_;
  tinyxml2::XMLDocument document_;
  double unit_m_ = 1.0;
};

/// Returns true for a .zae file, and for a .dae file with kinematics, which is a robot.
bool IsColladaRobot(const std::filesystem::path& path);

/// Returns the part of "#id" or "a/b/id" after the last '#' or '/'.
std::string_view LastPart(std::string_view reference);

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
