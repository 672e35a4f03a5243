#pragma once

#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace legopt {

/// Typed access to a YAML map; errors contain file, key and value. Internal to this module.
///
/// Every getter throws InputError if the value has the wrong type, and the Require getters if the key is missing; the
/// others then return nullopt.
class YamlFields {
 public:
  /// `place` is a prefix for keys in messages, e.g. "objects[3]"; may be empty. Throws if `map` is not a map or has a
  /// key that is not in `known` (with the nearest valid key).
  YamlFields(const YAML::Node& map, std::string file, std::string place, const std::vector<std::string>& known);
  /// The same without a check of the keys, for maps whose keys depend on a value in them.
  YamlFields(const YAML::Node& map, std::string file, std::string place);

  std::string RequireText(const std::string& key) const;                 ///< returns a non-empty text
  double RequireNumber(const std::string& key) const;                    ///< returns a finite number
  YAML::Node Require(const std::string& key) const;                      ///< returns any node but null
  std::optional<std::string> Text(const std::string& key) const;         ///< returns a non-empty text
  std::optional<double> Number(const std::string& key) const;            ///< returns a finite number
  std::optional<Eigen::Vector3d> Vector3(const std::string& key) const;  ///< returns three finite numbers
  /// Returns an undefined node if the key is missing.
  YAML::Node Get(const std::string& key) const;

  /// Throws InputError for `key` of this map.
  [[noreturn]] void Fail(const std::string& key, const std::string& value, const std::string& message,
                         const std::string& fix) const;

  const std::string& file() const { return file_; }  ///< name for errors
  /// Returns the place of `key` in the file, e.g. "objects[3].size".
  std::string Path(const std::string& key) const;

 private:
  YAML::Node map_;
  std::string file_;
  std::string place_;
};

/// Returns the text of a scalar, or a short description of another node, for messages.
std::string DescribeNode(const YAML::Node& node);

/// Returns a finite number, or nullopt.
std::optional<double> AsNumber(const YAML::Node& node);

/// Returns a list of three finite numbers, or nullopt.
std::optional<Eigen::Vector3d> AsVector3(const YAML::Node& node);

}  // namespace legopt
