#include "legopt/robot/internal/urdf_rules.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <system_error>
#include <vector>

namespace legopt {
namespace {

using Value = UrdfValue;
using Attributes = std::vector<UrdfAttributeRule>;
using Elements = std::vector<UrdfElementRule>;

constexpr bool kRequired = true;

UrdfElementRule Origin() {
  return {.name = "origin",
          .attributes = {{.name = "xyz", .value = Value::kThree},
                         {.name = "rpy", .value = Value::kThree},
                         {.name = "quat_xyzw", .refusal = "write the rotation as rpy=\"roll pitch yaw\", in radians"}}};
}

UrdfElementRule Inertial() {
  Attributes moments;
  for (const char* name : {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"}) {
    moments.push_back({.name = name, .value = Value::kNumber, .required = kRequired});
  }
  return {.name = "inertial",
          .children = {Origin(),
                       {.name = "mass",
                        .least = 1,
                        .attributes = {{.name = "value", .value = Value::kNotNegative, .required = kRequired}}},
                       {.name = "inertia", .least = 1, .attributes = std::move(moments), .replacement = "0"}}};
}

constexpr std::string_view kThin = "0.001";     // side of a flat box, m
constexpr std::string_view kDot = "0.0001";     // radius of a sphere that marks a contact point, m
constexpr std::string_view kUnlimited = "1e4";  // limit of a joint without one (kUnlimitedJoint of the judge)

UrdfElementRule Geometry() {
  const auto shape = [](std::string_view name, Attributes attributes) {
    return UrdfElementRule{.name = name, .attributes = std::move(attributes)};
  };
  const UrdfAttributeRule radius{.name = "radius", .value = Value::kPositive, .required = kRequired};
  const UrdfAttributeRule length{.name = "length", .value = Value::kPositive, .required = kRequired};
  UrdfAttributeRule dot = radius, size{.name = "size", .value = Value::kThreePositive, .required = kRequired};
  dot.zero = kDot;
  size.zero = kThin;
  return {.name = "geometry",
          .least = 1,
          .children = {shape("box", {size}), shape("sphere", {dot}), shape("cylinder", {radius, length}),
                       shape("capsule", {radius, length}),
                       shape("mesh", {{.name = "filename", .value = Value::kFile, .required = kRequired},
                                      {.name = "scale", .value = Value::kThreeNotZero, .one_for_all = true}})},
          .holds_one = true};
}

UrdfElementRule Material() {
  return {
      .name = "material",
      .attributes = {{.name = "name", .value = Value::kName, .required = kRequired}},
      .children = {{.name = "color", .attributes = {{.name = "rgba", .value = Value::kColor, .required = kRequired}}},
                   {.name = "texture",
                    .attributes = {{.name = "filename", .value = Value::kFile, .required = kRequired}}}},
      .read = false};
}

UrdfElementRule LinkRule() {
  return {.name = "link",
          .most = kAnyNumber,
          .attributes = {{.name = "name", .value = Value::kName, .required = kRequired}},
          .children = {Inertial(),
                       {.name = "visual",
                        .most = kAnyNumber,
                        .attributes = {{.name = "name", .read = false}},
                        .children = {Origin(), Geometry(), Material()},
                        .read = false,
                        .may_be_empty = true},
                       {.name = "collision",
                        .most = kAnyNumber,
                        .attributes = {{.name = "name", .read = false}},
                        .children = {Origin(), Geometry()},
                        .may_be_empty = true}}};
}

UrdfElementRule LinkName(std::string_view end) {
  return {.name = end, .least = 1, .attributes = {{.name = "link", .value = Value::kName, .required = kRequired}}};
}

UrdfElementRule Limit() {
  return {
      .name = "limit",
      .attributes = {
          {.name = "lower", .value = Value::kNumber, .infinity = kUnlimited},
          {.name = "upper", .value = Value::kNumber, .infinity = kUnlimited},
          {.name = "effort", .value = Value::kNumber, .required = kRequired, .replacement = "0", .infinity = "0"},
          {.name = "velocity", .value = Value::kNumber, .required = kRequired, .replacement = "0", .infinity = "0"}}};
}

/// Elements of a joint besides its frame, links, axis and limits.
Elements JointExtras() {
  return {{.name = "dynamics",
           .attributes = {{.name = "damping", .value = Value::kNumber}, {.name = "friction", .value = Value::kNumber}},
           .read = false},
          {.name = "safety_controller",
           .attributes = {{.name = "soft_lower_limit", .value = Value::kNumber},
                          {.name = "soft_upper_limit", .value = Value::kNumber},
                          {.name = "k_position", .value = Value::kNumber},
                          {.name = "k_velocity", .value = Value::kNumber, .required = kRequired, .doubtful = true}},
           .read = false},
          {.name = "calibration",
           .attributes = {{.name = "rising", .value = Value::kNumber},
                          {.name = "falling", .value = Value::kNumber},
                          {.name = "reference_position", .value = Value::kNumber}},
           .read = false},
          {.name = "mimic",
           .attributes = {{.name = "joint", .value = Value::kName, .required = kRequired},
                          {.name = "multiplier", .value = Value::kNumber},
                          {.name = "offset", .value = Value::kNumber}}}};
}

UrdfElementRule JointRule() {
  Elements children = {
      Origin(),
      LinkName("parent"),
      LinkName("child"),
      {.name = "axis", .attributes = {{.name = "xyz", .value = Value::kThree, .required = kRequired}}},
      Limit(),
  };
  for (UrdfElementRule& extra : JointExtras()) children.push_back(std::move(extra));
  return {.name = "joint",
          .most = kAnyNumber,
          .attributes = {{.name = "name", .value = Value::kName, .required = kRequired},
                         {.name = "type", .value = Value::kJointType, .required = kRequired}},
          .children = std::move(children)};
}

UrdfElementRule RobotRule() {
  UrdfElementRule material = Material();
  material.most = kAnyNumber;
  return {.name = "robot",
          .least = 1,
          .attributes = {{.name = "name", .value = Value::kName, .required = kRequired},
                         {.name = "version", .value = Value::kVersion, .read = false, .doubtful = true}},
          .children = {std::move(material), LinkRule(), JointRule()}};
}

}  // namespace

const UrdfElementRule& UrdfRobotRule() {
  static const UrdfElementRule rule = RobotRule();
  return rule;
}

namespace {

constexpr std::string_view kSpace = " \t\r\n";

/// Number of values, and the condition for each.
struct NumbersRule {
  std::size_t count = 1;
  bool (*holds)(double) = [](double) { return true; };
  const char* condition = "";  ///< the condition in words, "must ..."
};

std::optional<NumbersRule> NumbersOf(UrdfValue value) {
  constexpr auto kNotNegative = [](double x) { return x >= 0.0; };
  constexpr auto kPositive = [](double x) { return x > 0.0; };
  constexpr auto kNotZero = [](double x) { return x != 0.0; };
  constexpr auto kShare = [](double x) { return x >= 0.0 && x <= 1.0; };
  switch (value) {
    case UrdfValue::kNumber:
      return NumbersRule{};
    case UrdfValue::kNotNegative:
      return NumbersRule{.holds = kNotNegative, .condition = "must not be negative"};
    case UrdfValue::kPositive:
      return NumbersRule{.holds = kPositive, .condition = "must be positive"};
    case UrdfValue::kThree:
      return NumbersRule{.count = 3};
    case UrdfValue::kThreePositive:
      return NumbersRule{.count = 3, .holds = kPositive, .condition = "must be positive"};
    case UrdfValue::kThreeNotZero:
      return NumbersRule{.count = 3, .holds = kNotZero, .condition = "must not be zero"};
    case UrdfValue::kColor:
      return NumbersRule{.count = 4, .holds = kShare, .condition = "must be from 0 to 1"};
    default:
      return std::nullopt;
  }
}

const char* CountFix(std::size_t count) {
  switch (count) {
    case 1:
      return "write one number, such as 14.2";
    case 3:
      return "write three numbers, such as 0.2 0.1 0.05";
    default:
      return "write four numbers, such as 0.8 0.8 0.8 1";
  }
}

std::vector<std::string_view> Words(std::string_view text) {
  std::vector<std::string_view> words;
  for (std::size_t begin = text.find_first_not_of(kSpace); begin != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(kSpace, begin), text.size());
    words.push_back(text.substr(begin, end - begin));
    begin = text.find_first_not_of(kSpace, end);
  }
  return words;
}

bool IsNumberLetter(char c) {
  return (c >= '0' && c <= '9') || c == '+' || c == '-' || c == '.' || c == 'e' || c == 'E';
}

/// Parses a decimal number into `value`. Rejects infinity, NaN, hexadecimal numbers and trailing characters.
std::optional<UrdfValueDiagnostic> CheckNumber(std::string_view word, double* value) {
  const std::string_view digits = word.starts_with('+') ? word.substr(1) : word;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), *value);
  const bool whole = end == digits.data() + digits.size() && !digits.starts_with('+') && !word.starts_with("+-");
  if (whole && error == std::errc::result_out_of_range) {
    return UrdfValueDiagnostic{"does not fit into a double-precision number",
                               "write a number in SI units, such as 14.2"};
  }
  if (whole && error == std::errc() && !std::isfinite(*value)) {
    return UrdfValueDiagnostic{"must be a finite number", "give the true value"};
  }
  if (whole && error == std::errc() && std::all_of(word.begin(), word.end(), IsNumberLetter)) return std::nullopt;
  if (word.find(',') != std::string_view::npos) {
    return UrdfValueDiagnostic{"is not a number", "decimals take a point (14.2), and spaces separate numbers"};
  }
  return UrdfValueDiagnostic{"is not a number",
                             "write a plain number in SI units (metres, kilograms, radians), such as 14.2"};
}

UrdfValueText CheckNumbers(std::string_view text, const NumbersRule& rule) {
  UrdfValueText result;
  const std::vector<std::string_view> words = Words(text);
  for (const std::string_view word : words) {
    double value = 0.0;
    result.fault = CheckNumber(word, &value);
    if (result.fault) return result;
    if (!rule.holds(value) && words.size() == rule.count) {
      result.fault = UrdfValueDiagnostic{rule.condition, CountFix(rule.count)};
      return result;
    }
    if (!result.text.empty()) result.text += ' ';
    result.text += word;
  }
  if (words.size() != rule.count) {
    result.fault = UrdfValueDiagnostic{
        words.empty() ? "is empty"
                      : "has " + std::to_string(words.size()) + " numbers instead of " + std::to_string(rule.count),
        CountFix(rule.count)};
  }
  return result;
}

std::optional<UrdfValueDiagnostic> CheckName(std::string_view text, std::size_t most_bytes) {
  const auto is_control = [](unsigned char c) { return c < 0x20 || c == 0x7F; };
  if (text.empty()) return UrdfValueDiagnostic{"is empty", "give a name"};
  if (text.size() > most_bytes) {
    return UrdfValueDiagnostic{"is longer than " + std::to_string(most_bytes) + " bytes", "give a shorter name"};
  }
  if (std::any_of(text.begin(), text.end(), is_control)) {
    return UrdfValueDiagnostic{"has a control character", "write one line of plain text"};
  }
  return std::nullopt;
}

std::optional<UrdfValueDiagnostic> CheckJointType(std::string_view text) {
  constexpr std::array<std::string_view, 6> kTypes = {"revolute", "continuous", "prismatic",
                                                      "fixed",    "floating",   "planar"};
  if (std::find(kTypes.begin(), kTypes.end(), text) != kTypes.end()) return std::nullopt;
  return UrdfValueDiagnostic{"joint type is not supported", "use revolute, continuous, prismatic or fixed"};
}

std::optional<UrdfValueDiagnostic> CheckOther(std::string_view text, UrdfValue value) {
  constexpr std::size_t kNameBytes = 200, kFileBytes = 4096;
  switch (value) {
    case UrdfValue::kName:
      return CheckName(text, kNameBytes);
    case UrdfValue::kFile:
      return CheckName(text, kFileBytes);
    case UrdfValue::kJointType:
      return CheckJointType(text);
    case UrdfValue::kVersion:
      if (text == "1.0") return std::nullopt;
      return UrdfValueDiagnostic{"only version 1.0 of URDF can be read", "write version=\"1.0\", or leave it out"};
    default:
      return std::nullopt;
  }
}

}  // namespace

UrdfValueText CheckUrdfValue(std::string_view text, UrdfValue value) {
  const bool substitution = text.find("${") != std::string_view::npos || text.find("$(") != std::string_view::npos;
  if (value != UrdfValue::kText && substitution) {
    return {.text = "",
            .fault = UrdfValueDiagnostic{"is an xacro expression that has not been expanded",
                                         "expand the file first: xacro FILE.urdf.xacro > robot.urdf"}};
  }
  if (const auto numbers = NumbersOf(value)) return CheckNumbers(text, *numbers);
  return {.text = std::string(text), .fault = CheckOther(text, value)};
}

bool ReplaceSpecialNumbers(const UrdfAttributeRule& rule, std::string* text) {
  if (rule.zero.empty() && rule.infinity.empty()) return false;
  bool replaced = false;
  std::string result;
  for (const std::string_view word : Words(*text)) {
    double value = 0.0;
    const std::string_view digits = word.starts_with('+') ? word.substr(1) : word;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    const bool whole = end == digits.data() + digits.size() && error == std::errc();
    std::string written(word);
    if (whole && value == 0.0 && !rule.zero.empty()) written = rule.zero;
    if (whole && std::isinf(value) && !rule.infinity.empty()) {
      written = (value < 0 ? "-" : "") + std::string(rule.infinity);
    }
    replaced = replaced || written != word;
    result += (result.empty() ? "" : " ") + written;
  }
  if (replaced) *text = result;
  return replaced;
}

bool RepeatNumber(const UrdfAttributeRule& rule, std::string* text) {
  const std::vector<std::string_view> words = Words(*text);
  if (!rule.one_for_all || words.size() != 1) return false;
  const std::string number(words.front());
  *text = number + " " + number + " " + number;
  return true;
}

std::string PrintableUrdfText(std::string_view text) {
  constexpr std::size_t kShown = 60;
  const auto continues = [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U; };
  std::size_t end = std::min(text.size(), kShown);
  while (end > 0 && end < text.size() && continues(text[end])) --end;  // keep UTF-8 characters whole
  std::string shown(text.substr(0, end));
  std::replace_if(
      shown.begin(), shown.end(), [](unsigned char c) { return c < 0x20 || c == 0x7F; }, '?');
  return shown;
}

}  // namespace legopt
