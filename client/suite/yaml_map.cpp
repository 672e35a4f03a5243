#include "client/suite/yaml_map.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <utility>

#include "bus/message_limits.h"
#include "legopt/input/text.h"
#include "legopt/types/nearest_name.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

constexpr int kMaxNesting = 16;
constexpr int kMaxValues = 10'000;

// Truncates long values at a UTF-8 character.
std::string Shortened(const std::string& text) {
  constexpr std::size_t kMaxShown = 60;
  if (text.size() <= kMaxShown) return text;
  std::size_t end = kMaxShown;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
  return text.substr(0, end) + "...";
}

std::string Describe(const YAML::Node& node) {
  switch (node.Type()) {
    case YAML::NodeType::Scalar:
      return Shortened(node.Scalar());
    case YAML::NodeType::Sequence:
      return "a list";
    case YAML::NodeType::Map:
      return "a mapping";
    default:
      return "nothing";
  }
}

// Parses the complete text; "+1" is a number as well.
template <class Number>
std::optional<Number> Parse(const std::string& text) {
  Number value{};
  const char* first = text.data() + (text.size() > 1 && text[0] == '+' ? 1 : 0);
  const char* last = text.data() + text.size();
  const auto result = std::from_chars(first, last, value);
  if (result.ec != std::errc() || result.ptr != last) return std::nullopt;
  return value;
}

bool IsQuoted(const YAML::Node& node) { return node.Tag() == "!"; }

nlohmann::json ScalarToJson(const YAML::Node& node, const std::string& file, const std::string& field) {
  const std::string& text = node.Scalar();
  if (IsQuoted(node)) return text;
  if (text == "true" || text == "True") return true;
  if (text == "false" || text == "False") return false;
  if (text == "null" || text == "~" || text.empty()) return nullptr;
  if (const auto integer = Parse<std::int64_t>(text)) return *integer;
  if (text == ".inf" || text == "-.inf" || text == ".nan") {
    throw YamlFault(file, node, field, "must be a finite number", "");
  }
  if (const auto number = Parse<double>(text); number && std::isfinite(*number)) return *number;
  return text;
}

nlohmann::json ToJson(const YAML::Node& node, const std::string& file, const std::string& field, int depth,
                      int* values) {
  if (++*values > kMaxValues) throw YamlFault(file, node, field, "holds too many values", "");
  if (depth > kMaxNesting) throw YamlFault(file, node, field, "is nested too deeply", "");
  switch (node.Type()) {
    case YAML::NodeType::Scalar:
      return ScalarToJson(node, file, field);
    case YAML::NodeType::Sequence: {
      auto array = nlohmann::json::array();
      for (const auto& item : node) array.push_back(ToJson(item, file, field, depth + 1, values));
      return array;
    }
    case YAML::NodeType::Map: {
      auto object = nlohmann::json::object();
      for (const auto& item : node) {
        const std::string key = YamlString(item.first, file, field);
        object[key] = ToJson(item.second, file, field + "." + key, depth + 1, values);
      }
      return object;
    }
    default:
      return nullptr;
  }
}

}  // namespace

std::string YamlPlace(const std::string& file, const YAML::Node& node) {
  const YAML::Mark mark = node.Mark();
  return mark.is_null() ? file : file + ":" + std::to_string(mark.line + 1);
}

InputError YamlFault(const std::string& file, const YAML::Node& node, const std::string& field,
                     const std::string& message, const std::string& fix) {
  return InputError({YamlPlace(file, node), field, Describe(node), message, fix});
}

std::string YamlString(const YAML::Node& node, const std::string& file, const std::string& field) {
  if (!node.IsScalar()) throw YamlFault(file, node, field, "must be text", "");
  if (node.Scalar().empty()) throw InputError({YamlPlace(file, node), field, "", "is empty", "write a text"});
  return node.Scalar();
}

std::int64_t YamlInteger(const YAML::Node& node, const std::string& file, const std::string& field, std::int64_t low,
                         std::int64_t high) {
  const auto value = node.IsScalar() && !IsQuoted(node) ? Parse<std::int64_t>(node.Scalar()) : std::nullopt;
  if (!value || *value < low || *value > high) {
    throw YamlFault(file, node, field,
                    "must be a whole number from " + std::to_string(low) + " to " + std::to_string(high), "");
  }
  return *value;
}

nlohmann::json YamlToJson(const YAML::Node& node, const std::string& file, const std::string& field) {
  int values = 0;
  return ToJson(node, file, field, 0, &values);
}

YamlMap::YamlMap(const YAML::Node& node, std::string file, std::string path, std::vector<std::string> valid_keys)
    : node_(node), file_(std::move(file)), path_(std::move(path)), valid_keys_(std::move(valid_keys)) {
  if (!node_.IsMap()) {
    throw YamlFault(file_, node_, path_, "must be a mapping of keys to values", SuggestName("", valid_keys_));
  }
  for (const auto& item : node_) {
    const std::string key = YamlString(item.first, file_, path_);
    if (std::find(valid_keys_.begin(), valid_keys_.end(), key) == valid_keys_.end()) {
      throw InputError({YamlPlace(file_, item.first), Path(key), "", "unknown key", SuggestName(key, valid_keys_)});
    }
  }
}

bool YamlMap::Has(const std::string& key) const { return node_[key].IsDefined(); }

YAML::Node YamlMap::Get(const std::string& key) const {
  const YAML::Node value = node_[key];
  if (!value.IsDefined()) throw InputError({YamlPlace(file_, node_), Path(key), "", "is missing", "add it"});
  return value;
}

std::string YamlMap::String(const std::string& key) const { return YamlString(Get(key), file_, Path(key)); }

std::string YamlMap::Name(const std::string& key) const {
  constexpr std::size_t kMost = bus::spec_limits::kMostNameBytes;
  const std::string name = String(key);
  if (name.size() > kMost) {
    throw YamlFault(
        file_, Get(key), Path(key),
        "is " + std::to_string(name.size()) + " bytes long, at most " + std::to_string(kMost) + " are possible",
        "choose a shorter one");
  }
  if (const auto fault = DiagnoseName(name)) throw YamlFault(file_, Get(key), Path(key), fault->message, fault->fix);
  return name;
}

std::int64_t YamlMap::Integer(const std::string& key, std::int64_t low, std::int64_t high) const {
  return YamlInteger(Get(key), file_, Path(key), low, high);
}

double YamlMap::Number(const std::string& key, double low, double high) const {
  const YAML::Node node = Get(key);
  const auto value = node.IsScalar() && !IsQuoted(node) ? Parse<double>(node.Scalar()) : std::nullopt;
  if (!value || !(*value >= low && *value <= high)) {
    throw YamlFault(file_, node, Path(key),
                    "must be a number from " + FormatGeneral(low) + " to " + FormatGeneral(high), "");
  }
  return *value;
}

bool YamlMap::Boolean(const std::string& key) const {
  const YAML::Node node = Get(key);
  if (!node.IsScalar() || IsQuoted(node) || (node.Scalar() != "true" && node.Scalar() != "false")) {
    throw YamlFault(file_, node, Path(key), "must be true or false", "");
  }
  return node.Scalar() == "true";
}

std::vector<YAML::Node> YamlMap::List(const std::string& key) const {
  const YAML::Node node = Get(key);
  if (node.IsScalar()) return {node};
  if (!node.IsSequence()) throw YamlFault(file_, node, Path(key), "must be a list", "");
  if (node.size() == 0) {
    throw InputError({YamlPlace(file_, node), Path(key), "[]", "must not be empty", "add an item or remove the key"});
  }
  return {node.begin(), node.end()};
}

std::string YamlMap::Path(const std::string& key) const { return path_.empty() ? key : path_ + "." + key; }

std::string YamlMap::Path(const std::string& key, std::size_t index) const {
  return Path(key) + "[" + std::to_string(index) + "]";
}

}  // namespace legopt::client
