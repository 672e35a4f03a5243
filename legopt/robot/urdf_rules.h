#pragma once

#include <string_view>
#include <vector>

namespace legopt {

/// What an attribute of a URDF must hold. Numbers: decimal, finite, in the C locale, separated by white space.
enum class UrdfValue {
  kText,           ///< anything
  kName,           ///< 1 to 200 bytes without control characters
  kFile,           ///< the same, up to 4,096 bytes
  kVersion,        ///< 1.0
  kJointType,      ///< revolute, continuous, prismatic or fixed
  kNumber,         ///< one number
  kNotNegative,    ///< one number, 0 or more
  kPositive,       ///< one number above 0
  kThree,          ///< three numbers
  kThreePositive,  ///< three numbers above 0
  kThreeNotZero,   ///< three numbers, none of them 0
  kColor,          ///< four numbers from 0 to 1
};

/// An attribute and what it must hold.
struct UrdfAttributeRule {
  std::string_view name;               ///< as written in the file
  UrdfValue value = UrdfValue::kText;  ///< what its text must be
  bool required = false;               ///< a missing one is a fault
  bool read = true;                    ///< false: looked at, but nothing depends on it
  std::string_view refusal = {};       ///< not empty: nobody may give it, and this is what to do instead
};

/// An element, its attributes and the elements inside of it. What no rule names is no part of a robot and not read.
struct UrdfElementRule {
  std::string_view name;                           ///< tag, as written in the file
  int least = 0;                                   ///< times that it must stand there; fewer are a fault
  int most = 1;                                    ///< kAnyNumber: no limit
  std::vector<UrdfAttributeRule> attributes = {};  ///< others are let by, unless they look like one of these
  std::vector<UrdfElementRule> children = {};      ///< likewise
  bool read = true;                                ///< false: looked at, but nothing depends on it
  bool holds_one = false;                          ///< exactly one of the children, and nothing else
  std::string_view refusal = {};  ///< not empty: the element may not be there, and this is what to do instead
};

/// UrdfElementRule::most without a limit.
inline constexpr int kAnyNumber = 1'000'000'000;

/// The rules of `<robot>`, for everything that urdfdom 3 looks at.
const UrdfElementRule& UrdfRobotRule();

}  // namespace legopt
