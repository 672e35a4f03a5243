#include "client/compare/charge.h"

#include <algorithm>

namespace legopt::client {
namespace {

Charge ChargeOf(std::span<const SolveCell> cells, Task task) {
  std::optional<double> limit_ms;
  for (const SolveCell& cell : cells) {
    if (cell.column.task != task) continue;
    if (cell.effort_limited) return {kPenaltyFactor * kLimitPerWaypoint_ms, ChargeRule::kPerWaypoint};
    limit_ms = std::min(limit_ms.value_or(cell.limit_ms), cell.limit_ms);
  }
  return {kPenaltyFactor * limit_ms.value_or(0.0), ChargeRule::kWallLimit};
}

}  // namespace

double Charge::Apply(const ProblemRuns& problem) const {
  return problem.time.Charged(rule == ChargeRule::kPerWaypoint ? ms * problem.waypoints : ms);
}

EnumArray<Task, Charge> ChargesOf(std::span<const SolveCell> cells, std::optional<double> chosen_ms) {
  EnumArray<Task, Charge> charges;
  for (const TaskDescription& description : kTasks) {
    charges[description.task] = chosen_ms ? Charge{*chosen_ms, ChargeRule::kChosen} : ChargeOf(cells, description.task);
  }
  return charges;
}

std::string DescribeCharge(const Charge& charge, const TimeUnit& unit) {
  constexpr double kMillisecondsPerSecond = 1e3;
  const std::string time = FormatTime(charge.ms / kMillisecondsPerSecond, unit) + " " + unit.name;
  switch (charge.rule) {
    case ChargeRule::kChosen:
      return time + ", as chosen";
    case ChargeRule::kPerWaypoint:
      return time + " for each waypoint of the problem";
    case ChargeRule::kWallLimit:
      return time + ", ten times the limit of wall time";
  }
  return time;
}

const char* EnumNameOf(ChargeRule rule) {
  switch (rule) {
    case ChargeRule::kChosen:
      return "chosen";
    case ChargeRule::kPerWaypoint:
      return "per_waypoint";
    case ChargeRule::kWallLimit:
      return "wall_limit";
  }
  return "";
}

const char* TitleOfChargedMean(ChargeRule rule) { return rule == ChargeRule::kChosen ? "Charged" : "PAR10"; }

}  // namespace legopt::client
