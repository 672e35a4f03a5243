#include "legopt/dataset/internal/yaml_fields.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "legopt/input/text.h"
#include "legopt/types/input_error.h"
#include "legopt/types/nearest_name.h"
#include "legopt/types/number_text.h"

namespace legopt {

std::string DescribeNode(const YAML::Node& node) {
  if (!node.IsDefined() || node.IsNull()) return "nothing";
  if (node.IsScalar()) return node.Scalar();
  return node.IsMap() ? "a map" : "a list";
}

std::optional<double> AsNumber(const YAML::Node& node) {
  if (!node.IsDefined() || !node.IsScalar()) return std::nullopt;
  const std::optional<double> value = ParseNumber(node.Scalar());
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::optional<Eigen::Vector3d> AsVector3(const YAML::Node& node) {
  if (!node.IsDefined() || !node.IsSequence() || node.size() != 3) return std::nullopt;
  Eigen::Vector3d vector;
  for (int i = 0; i < 3; ++i) {
    const std::optional<double> value = AsNumber(node[static_cast<size_t>(i)]);
    if (!value) return std::nullopt;
    vector[i] = *value;
  }
  return vector;
}

YamlFields::YamlFields(const YAML::Node& map, std::string file, std::string place)
    : map_(map), file_(std::move(file)), place_(std::move(place)) {
  if (!map_.IsMap()) Fail("", DescribeNode(map_), "must be a map of keys and values", "write 'key: value' lines");
}

YamlFields::YamlFields(const YAML::Node& map, std::string file, std::string place,
                       const std::vector<std::string>& known)
    : YamlFields(map, std::move(file), std::move(place)) {
  for (const auto& entry : map_) {
    const std::string key = DescribeNode(entry.first);
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      Fail(key, "", "unknown key", SuggestName(key, known));
    }
  }
}

YAML::Node YamlFields::Get(const std::string& key) const {
  for (const auto& entry : map_) {
    if (entry.first.IsScalar() && entry.first.Scalar() == key) return entry.second;
  }
  return YAML::Node(YAML::NodeType::Undefined);
}

YAML::Node YamlFields::Require(const std::string& key) const {
  YAML::Node node = Get(key);
  if (!node.IsDefined() || node.IsNull()) Fail(key, "", "the key is missing", "add '" + key + ": ...'");
  return node;
}

std::optional<std::string> YamlFields::Text(const std::string& key) const {
  const YAML::Node node = Get(key);
  if (!node.IsDefined()) return std::nullopt;
  if (!node.IsScalar() || node.Scalar().empty()) Fail(key, DescribeNode(node), "must be a text", "write one word");
  return node.Scalar();
}

std::optional<double> YamlFields::Number(const std::string& key) const {
  const YAML::Node node = Get(key);
  if (!node.IsDefined()) return std::nullopt;
  const std::optional<double> value = AsNumber(node);
  if (!value) Fail(key, DescribeNode(node), "must be a finite number", "write a number in SI units");
  return value;
}

std::optional<Eigen::Vector3d> YamlFields::Vector3(const std::string& key) const {
  const YAML::Node node = Get(key);
  if (!node.IsDefined()) return std::nullopt;
  const std::optional<Eigen::Vector3d> vector = AsVector3(node);
  if (!vector) Fail(key, DescribeNode(node), "must be three finite numbers", "write [x, y, z]");
  return vector;
}

std::string YamlFields::RequireText(const std::string& key) const {
  Require(key);
  return *Text(key);
}

double YamlFields::RequireNumber(const std::string& key) const {
  Require(key);
  return *Number(key);
}

std::string YamlFields::Path(const std::string& key) const {
  if (key.empty()) return place_;
  return place_.empty() ? key : place_ + "." + key;
}

void YamlFields::Fail(const std::string& key, const std::string& value, const std::string& message,
                      const std::string& fix) const {
  throw InputError({.file = file_, .field = Path(key), .value = value, .message = message, .fix = fix});
}

}  // namespace legopt
