#pragma once

#include <tinyxml2.h>

#include <string>
#include <string_view>
#include <vector>

#include "legopt/robot/internal/urdf_rules.h"
#include "legopt/types/input_error.h"

namespace legopt {

/// How much a fault of a URDF matters.
enum class UrdfSeverity {
  kInfo,      ///< fault in a part that nothing reads, such as `<visual>`
  kRepaired,  ///< changed, in a way that cannot falsify a result
  kWarning    ///< probably a mistake, but the robot is usable
};

/// A fault that does not prevent the use of a URDF, or several of the same kind.
struct UrdfDiagnostic {
  UrdfSeverity severity = UrdfSeverity::kWarning;
  std::string field;    ///< links, joints or elements with line numbers; at most three, and how many more there are
  std::string value;    ///< may be empty
  std::string message;  ///< the problem, and how it was repaired
  std::string fix;      ///< advice to the user; may be empty
};

/// Collects all faults of a URDF.
class UrdfFaults {
 public:
  explicit UrdfFaults(std::string source) : source_(std::move(source)) {}

  /// Adds a fault that makes results meaningless.
  void Refuse(const std::string& place, std::string_view value, const std::string& message, std::string_view fix);
  /// Adds another fault. Those with the same message form a group.
  void Note(UrdfSeverity severity, const std::string& place, std::string_view value, const std::string& message,
            std::string_view fix = {});

  bool refuses() const { return !refused_.empty(); }  ///< true if Check() will throw
  /// Throws InputError with all refused faults, at most three per kind, if there are any.
  void Check() const;
  /// Returns one entry per group, in the order of the first.
  std::vector<UrdfDiagnostic> notes() const;

 private:
  struct Group {
    UrdfDiagnostic first;
    std::vector<std::string> places;
  };
  std::string source_;
  std::vector<InputError::Fault> refused_;
  std::vector<Group> groups_;
};

/// Returns the location for errors, "link 'pelvis'". Elements with a name start a new location; others extend `outer`.
std::string UrdfPlaceOf(const tinyxml2::XMLElement& element, const std::string& outer);

/// Appends the line of an element to a location.
std::string WithLine(const std::string& place, const tinyxml2::XMLElement& element);

/// Checks an element with all its parts against its rule. Writes what is read, repaired where the rule allows it, to
/// `copy`; null: nothing of this element is read, and its faults are notes.
void WalkUrdf(const tinyxml2::XMLElement& element, const UrdfElementRule& rule, const std::string& place,
              tinyxml2::XMLElement* copy, UrdfFaults* faults);

}  // namespace legopt
