#include "client/compare/charge.h"

#include <algorithm>

namespace legopt::client {
namespace {

double LongestSolved_ms(const SolveCell& cell) {
  double longest_ms = 0.0;
  for (const Solve& solve : cell.solves) {
    if (solve.end == statistics::RunEnd::kSolved) longest_ms = std::max(longest_ms, solve.time_ms);
  }
  return longest_ms;
}

Charge ChargeOf(std::span<const SolveCell> cells, Task task) {
  double longest_ms = 0.0;
  std::optional<double> limit_ms;
  bool effort_limited = false;
  for (const SolveCell& cell : cells) {
    if (cell.column.task != task) continue;
    longest_ms = std::max(longest_ms, LongestSolved_ms(cell));
    limit_ms = std::min(limit_ms.value_or(cell.limit_ms), cell.limit_ms);
    effort_limited = effort_limited || cell.effort_limited;
  }
  if (effort_limited && longest_ms > 0.0) return {kPenaltyFactor * longest_ms, ChargeRule::kLongestSolved};
  return {kPenaltyFactor * limit_ms.value_or(0.0), ChargeRule::kWallLimit};
}

}  // namespace

Per<Task, Charge> ChargesOf(std::span<const SolveCell> cells, std::optional<double> chosen_ms) {
  Per<Task, Charge> charges;
  for (const TaskDescription& description : kTasks) {
    charges[description.task] = chosen_ms ? Charge{*chosen_ms, ChargeRule::kChosen} : ChargeOf(cells, description.task);
  }
  return charges;
}

std::string DescribeCharge(const Charge& charge, Task task, const TimeUnit& unit) {
  constexpr double kMillisecondsPerSecond = 1e3;
  const std::string time = FormatTime(charge.ms / kMillisecondsPerSecond, unit) + " " + unit.name;
  switch (charge.rule) {
    case ChargeRule::kChosen:
      return time + ", as chosen";
    case ChargeRule::kLongestSolved:
      return time + ", ten times the longest solved run of " + std::string(ToString(task));
    case ChargeRule::kWallLimit:
      return time + ", ten times the limit of wall time";
  }
  return time;
}

const char* WordOf(ChargeRule rule) {
  switch (rule) {
    case ChargeRule::kChosen:
      return "chosen";
    case ChargeRule::kLongestSolved:
      return "longest_solved";
    case ChargeRule::kWallLimit:
      return "wall_limit";
  }
  return "";
}

const char* TitleOfChargedMean(ChargeRule rule) { return rule == ChargeRule::kChosen ? "Charged" : "PAR10"; }

}  // namespace legopt::client
