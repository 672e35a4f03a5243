#pragma once

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "legopt/types/check.h"

namespace legopt {

/// A value of a check, described for people.
struct CheckFinding {
  std::string subject;  ///< contact, joint, link or pair
  std::string detail;   ///< subject, value and tolerance
};

/// Includes a value in the largest ones, one per check and rule. NaN counts as infinite. `subject` returns a string and
/// is called only for a new largest value above 0.
template <class Subject>
void IncludeViolation(Verdict check, Rule rule, int waypoint, double value, const Subject& subject,
                      std::vector<Violation>* violations) {
  if (std::isnan(value)) value = std::numeric_limits<double>::infinity();
  Violation* largest = nullptr;
  for (Violation& violation : *violations) {
    if (violation.check == check && violation.rule == rule) largest = &violation;
  }
  if (largest != nullptr && !(value > largest->value)) return;
  if (largest == nullptr) largest = &violations->emplace_back();
  *largest = {.check = check,
              .rule = rule,
              .waypoint = waypoint,
              .subject = value > 0 ? subject() : std::string(),
              .value = value};
}

}  // namespace legopt
