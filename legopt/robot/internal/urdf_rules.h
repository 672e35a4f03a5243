#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace legopt {

/// Type of a URDF attribute. Numbers are decimal, finite, in the C locale, separated by white space.
enum class UrdfValue {
  kText,           ///< anything
  kName,           ///< 1 to 200 bytes without control characters
  kFile,           ///< 1 to 4,096 bytes without control characters
  kVersion,        ///< 1.0
  kJointType,      ///< revolute, continuous, prismatic, fixed, floating or planar
  kNumber,         ///< one number
  kNotNegative,    ///< one number, 0 or more
  kPositive,       ///< one number above 0
  kThree,          ///< three numbers
  kThreePositive,  ///< three numbers above 0
  kThreeNotZero,   ///< three numbers, none of them 0
  kColor,          ///< four numbers from 0 to 1
};

/// Rule of one attribute.
struct UrdfAttributeRule {
  std::string_view name;
  UrdfValue value = UrdfValue::kText;
  bool required = false;
  bool read = true;                   ///< false: checked, but not used
  bool doubtful = false;              ///< if not used: a fault is a warning, because other programs refuse it
  std::string_view refusal = {};      ///< not empty: the attribute is forbidden, and this is the advice to the user
  std::string_view replacement = {};  ///< not empty: text of a required attribute that is missing
  std::string_view zero = {};         ///< not empty: text instead of a number 0
  std::string_view infinity = {};     ///< not empty: text instead of an infinite number, without sign
  bool one_for_all = false;           ///< one number instead of three is the value of all three
};

/// Rule of an element, with its attributes and children. Elements without a rule are not part of the robot and not
/// read.
struct UrdfElementRule {
  std::string_view name;                           ///< tag
  int least = 0;                                   ///< minimum number of occurrences
  int most = 1;                                    ///< maximum number of occurrences; kAnyNumber: no limit
  std::vector<UrdfAttributeRule> attributes = {};  ///< others are ignored, except misspellings of these
  std::vector<UrdfElementRule> children = {};      ///< others are ignored, except misspellings of these
  bool read = true;                                ///< false: checked, but not used
  bool holds_one = false;                          ///< exactly one child is required, and no others are allowed
  std::string_view refusal = {};      ///< not empty: the element is forbidden, and this is the advice to the user
  bool may_be_empty = false;          ///< left out if it contains no `<geometry>`, or an empty one
  std::string_view replacement = {};  ///< not empty: value of all attributes if the element is missing
};

/// Value of UrdfElementRule::most for no limit.
inline constexpr int kAnyNumber = 1'000'000'000;

/// Rules of `<robot>`, for everything that urdfdom 3 reads.
const UrdfElementRule& UrdfRobotRule();

/// A fault of an attribute's text, with advice.
struct UrdfValueDiagnostic {
  std::string message;  ///< the requirement that the text violates
  std::string fix;      ///< advice to the user; may be empty
};

/// Normalised text of an attribute: numbers separated by single spaces, other text unchanged.
struct UrdfValueText {
  std::string text;                                         ///< undefined if there is a fault
  std::optional<UrdfValueDiagnostic> fault = std::nullopt;  ///< set if the text is not a valid value
};

/// Checks the text of an attribute (urdf_rules.h). Faults are returned, not thrown.
UrdfValueText CheckUrdfValue(std::string_view text, UrdfValue value);

/// Replaces the zeros and infinities for which the rule has a text. Returns true if there were any.
bool ReplaceSpecialNumbers(const UrdfAttributeRule& rule, std::string* text);

/// Writes one number three times if the rule permits one. Returns true if it did.
bool RepeatNumber(const UrdfAttributeRule& rule, std::string* text);

/// Returns the text for a message: at most 60 bytes, control characters as '?'.
std::string PrintableUrdfText(std::string_view text);

}  // namespace legopt
