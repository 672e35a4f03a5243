#include "legopt/types/check.h"

#include "legopt/types/number_text.h"

namespace legopt {

std::string ToleranceText(const CheckDescription& check) {
  if (!check.measured()) return "";
  constexpr double kPercent = 100.0;
  if (check.check == Verdict::kStep) return FormatGeneral(kPercent * check.tolerance) + " % of the robot's size";
  return FormatGeneral(check.tolerance) + (check.unit == "m" || check.unit == "N" ? " " + std::string(check.unit) : "");
}

}  // namespace legopt
