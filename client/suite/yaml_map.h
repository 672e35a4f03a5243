#pragma once

#include <yaml-cpp/yaml.h>

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "legopt/input_error.h"

namespace legopt::client {

/// One mapping of a YAML file, read strictly: every fault is an `InputError` whose file is "FILE:LINE" and whose field
/// is the path of the key, e.g. "methods[1].sample_size".
class YamlMap {
 public:
  /// Throws when `node` is not a mapping or has a key that is not in `valid_keys` (the error names the nearest valid
  /// one). `path` is empty for the top level.
  YamlMap(const YAML::Node& node, std::string file, std::string path, std::vector<std::string> valid_keys);

  bool Has(const std::string& key) const;
  /// The value of a key; throws when the key is missing.
  YAML::Node Get(const std::string& key) const;

  /// Typed values. Throw when the key is missing, is of another type, or lies outside [low, high].
  std::string String(const std::string& key) const;
  /// Text of at most bus::spec_limits::kMostNameBytes bytes, without NUL.
  std::string Name(const std::string& key) const;
  std::int64_t Integer(const std::string& key, std::int64_t low, std::int64_t high) const;
  double Number(const std::string& key, double low, double high) const;
  bool Boolean(const std::string& key) const;

  /// The items of a list; a single scalar counts as a list of one. Throws when the list is empty.
  std::vector<YAML::Node> List(const std::string& key) const;

  /// Path of a key of this mapping, and of an item of a list in it.
  std::string Path(const std::string& key) const;
  std::string Path(const std::string& key, std::size_t index) const;

  const std::string& file() const { return file_; }
  const YAML::Node& node() const { return node_; }

 private:
  YAML::Node node_;
  std::string file_;
  std::string path_;
  std::vector<std::string> valid_keys_;
};

/// The error for a node: "FILE:LINE: FIELD: MESSAGE (got VALUE); FIX".
InputError YamlFault(const std::string& file, const YAML::Node& node, const std::string& field,
                     const std::string& message, const std::string& fix);

/// "FILE:LINE" of a node.
std::string YamlPlace(const std::string& file, const YAML::Node& node);

/// Scalar conversions with the node's place in the error.
std::string YamlString(const YAML::Node& node, const std::string& file, const std::string& field);
std::int64_t YamlInteger(const YAML::Node& node, const std::string& file, const std::string& field, std::int64_t low,
                         std::int64_t high);

/// A YAML value as JSON: unquoted scalars become null, booleans, integers or finite numbers where they look like
/// them, everything else a string. Throws for a number that is not finite and for nesting deeper than 16.
nlohmann::json YamlToJson(const YAML::Node& node, const std::string& file, const std::string& field);

}  // namespace legopt::client
