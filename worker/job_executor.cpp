#include "worker/job_executor.h"

#include <limits>

#include "app/printable.h"

namespace legopt::worker {
std::string PrintableText(std::string_view text, std::size_t max_bytes) {
  return app::WithoutControls(text.substr(0, max_bytes));
}

std::string PrintableTail(std::string_view text, std::size_t max_bytes) {
  if (text.size() > max_bytes) text.remove_prefix(text.size() - max_bytes);
  return app::WithoutControls(text);
}

legopt_msg::result_request ResultWithoutSolution(ReportedOutcome outcome, std::string_view message) {
  constexpr double kNotAvailable = std::numeric_limits<double>::quiet_NaN();
  legopt_msg::result_request result{};
  result.outcome = static_cast<std::int8_t>(outcome);
  result.message = PrintableText(message, kMaxMessageBytes);
  result.solver_cost = kNotAvailable;
  result.solver_violation = kNotAvailable;
  result.failed_waypoint = -1;
  result.cost = kNotAvailable;
  result.interpolation_environment_depth_m = kNotAvailable;
  result.interpolation_self_depth_m = kNotAvailable;
  result.interpolation_free_share = kNotAvailable;
  return result;
}

}  // namespace legopt::worker
