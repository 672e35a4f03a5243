#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "legopt/robot/urdf_rules.h"

namespace legopt {

/// What is wrong with a text, and what to do about it.
struct UrdfValueFault {
  std::string message;  ///< what the text should be
  std::string fix;      ///< what the user can do; may be empty
};

/// The text of an attribute as it is to be passed on: numbers with single spaces between them, all else unchanged.
struct UrdfValueText {
  std::string text;                                    ///< of no use where there is a fault
  std::optional<UrdfValueFault> fault = std::nullopt;  ///< set: the text does not hold such a value
};

/// Looks at the text of an attribute (urdf_rules.h). Never throws for what it finds.
UrdfValueText CheckUrdfValue(std::string_view text, UrdfValue value);

/// The text for a message: at most 60 bytes, control characters as '?'.
std::string ShownUrdfText(std::string_view text);

}  // namespace legopt
