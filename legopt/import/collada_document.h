#pragma once

#include <tinyxml2.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace legopt {

/// A COLLADA file as XML, with the few ways of reading elements that its parts share. Internal to the room.
///
/// `.dae` is read as it is, `.zae` (a zip archive) must hold exactly one `.dae`. Every error is an InputError that
/// names the file and the line in the document.
class ColladaDocument {
 public:
  /// Throws InputError: missing file, no archive, several documents in it, not XML, no `<COLLADA>` element, an axis
  /// other than z pointing up, a unit that is not positive.
  explicit ColladaDocument(const std::filesystem::path& path);

  /// `<COLLADA>`; lives as long as the document.
  const tinyxml2::XMLElement& root() const { return *document_.RootElement(); }
  /// Metres per unit of length of the document.
  double unit_m() const { return unit_m_; }
  std::string file() const { return path_.string(); }  ///< path, for messages

  /// All elements of this name below `root` (not inside each other), in the order of the document.
  static std::vector<const tinyxml2::XMLElement*> FindAll(const tinyxml2::XMLElement& root, const char* name);
  /// The first one, or null.
  static const tinyxml2::XMLElement* FindFirst(const tinyxml2::XMLElement& root, const char* name);

  /// Value of an attribute; throws when it is missing or empty.
  std::string Attribute(const tinyxml2::XMLElement& element, const char* name) const;
  /// Finite numbers separated by white space; throws when there are not `count` of them (any number for -1).
  std::vector<double> Numbers(const tinyxml2::XMLElement& element, int count) const;
  /// Number in `<name>` of the parent, wrapped in `<float>` or not; `fallback` when there is none.
  double Number(const tinyxml2::XMLElement& parent, const char* name, double fallback) const;
  /// Truth in `<name>` of the parent, wrapped in `<bool>` or not; `fallback` when there is none.
  bool Flag(const tinyxml2::XMLElement& parent, const char* name, bool fallback) const;
  /// Product of the `<translate>`, `<rotate>` (degrees) and `<matrix>` children in their order; lengths in metres.
  Eigen::Isometry3d Transform(const tinyxml2::XMLElement& element) const;

  /// Throws an InputError that names the file and the line of the element.
  [[noreturn]] void Fail(const tinyxml2::XMLElement& element, const std::string& value, const std::string& message,
                         const std::string& fix) const;

 private:
  std::filesystem::path path_;
  tinyxml2::XMLDocument document_;
  double unit_m_ = 1.0;
};

/// True for a .zae file, and for a .dae file that describes kinematics and so a robot.
bool IsColladaRobot(const std::filesystem::path& path);

/// Part of "#id" or "a/b/id" after the last '#' or '/'.
std::string_view LastPart(std::string_view reference);

}  // namespace legopt
