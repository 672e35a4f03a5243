#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "legopt/robot/urdf_rules.h"

namespace legopt {

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

/// Returns the text for a message: at most 60 bytes, control characters as '?'.
std::string PrintableUrdfText(std::string_view text);

}  // namespace legopt
