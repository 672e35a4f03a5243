#pragma once

#include <yaml-cpp/yaml.h>

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "legopt/types/input_error.h"

namespace legopt::client {

/// A strictly validated mapping of a YAML file: every error is an `InputError` with file "FILE:LINE" and the path of
/// the key as field, e.g. "methods[1].sample_size".
class YamlMap {
 public:
  /// Throws if `node` is not a mapping or has a key that is not in `valid_keys` (the error names the most similar one).
  /// `path` is empty for the top level.
  YamlMap(const YAML::Node& node, std::string file, std::string path, std::vector<std::string> valid_keys);

  bool Has(const std::string& key) const;
  /// Returns the value of a key; throws if the key is missing.
  YAML::Node Get(const std::string& key) const;

  /// Typed values. Throw if the key is missing, has another type, or is outside [low, high].
  std::string String(const std::string& key) const;
  /// Text of at most bus::spec_limits::kMostNameBytes bytes, without NUL.
  std::string Name(const std::string& key) const;
  std::int64_t Integer(const std::string& key, std::int64_t low, std::int64_t high) const;
  double Number(const std::string& key, double low, double high) const;
  bool Boolean(const std::string& key) const;

  /// Returns the items of a list; a single scalar is a list of one item. Throws if the list is empty.
  std::vector<YAML::Node> List(const std::string& key) const;

  /// Returns the path of a key of this mapping, or of an item of a list in it.
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

/// Creates the error for a node: "FILE:LINE: FIELD: MESSAGE (got VALUE); FIX".
InputError YamlFault(const std::string& file, const YAML::Node& node, const std::string& field,
                     const std::string& message, const std::string& fix);

/// Returns "FILE:LINE" of a node.
std::string YamlPlace(const std::string& file, const YAML::Node& node);

/// Scalar conversions; errors contain the node's location.
std::string YamlString(const YAML::Node& node, const std::string& file, const std::string& field);
std::int64_t YamlInteger(const YAML::Node& node, const std::string& file, const std::string& field, std::int64_t low,
                         std::int64_t high);

/// Converts a YAML value to JSON: unquoted scalars that look like null, booleans, integers or finite numbers are
/// converted, all others become strings. Throws for non-finite numbers and nesting deeper than 16.
nlohmann::json YamlToJson(const YAML::Node& node, const std::string& file, const std::string& field);

}  // namespace legopt::client
