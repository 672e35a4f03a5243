#pragma once

#include <tinyxml2.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

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

}  // namespace legopt
