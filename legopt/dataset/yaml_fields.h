#pragma once

#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace legopt {

/// Typed access to one YAML map whose keys are known, with errors that name file, key and value. Internal to the room.
///
/// Every getter throws InputError when the key is missing (Require...) or has a value of another kind. Getters without
/// Require return nullopt when the key is missing.
class YamlFields {
 public:
  /// `place` is put before keys in messages, e.g. "objects[3]"; may be empty. Throws when `map` is not a map or has a
  /// key that is not in `known` (naming the nearest).
  YamlFields(const YAML::Node& map, std::string file, std::string place, const std::vector<std::string>& known);

  std::string RequireText(const std::string& key) const;                 ///< not empty
  double RequireNumber(const std::string& key) const;                    ///< finite
  YAML::Node Require(const std::string& key) const;                      ///< any node but null
  std::optional<std::string> Text(const std::string& key) const;         ///< not empty
  std::optional<double> Number(const std::string& key) const;            ///< finite
  std::optional<Eigen::Vector3d> Vector3(const std::string& key) const;  ///< three finite numbers
  /// Undefined node when the key is missing.
  YAML::Node Get(const std::string& key) const;

  /// Throws InputError for this map's `key`.
  [[noreturn]] void Fail(const std::string& key, const std::string& value, const std::string& message,
                         const std::string& fix) const;

  const std::string& file() const { return file_; }  ///< name for errors

 private:
  YAML::Node map_;
  std::string file_;
  std::string place_;
};

/// Text of a scalar, or a short description of anything else, for messages.
std::string DescribeNode(const YAML::Node& node);

/// Finite number, or nullopt.
std::optional<double> AsNumber(const YAML::Node& node);

}  // namespace legopt
