#include "db/records.h"

#include <array>
#include <cmath>

namespace legopt::db {
namespace {

// In the order of the enumerators.
constexpr std::array<std::string_view, 6> kJobStates{"queued", "leased", "done", "failed", "dead", "cancelled"};
constexpr std::array<std::string_view, 9> kAttemptOutcomes{
    "running", "finished", "crashed", "time_limit", "memory_limit", "error", "expired", "cancelled", "returned"};
constexpr std::array<std::string_view, 3> kExperimentStates{"active", "done", "cancelled"};
constexpr std::array<std::string_view, 3> kHolds{"none", "paused", "held"};
constexpr std::array<std::string_view, 7> kSolverStatuses{
    "not_run",           "converged_feasible", "converged_infeasible", "iteration_limit", "time_limit",
    "numerical_failure", "cancelled"};
constexpr std::array<std::string_view, 9> kVerdicts{
    kSuccess,      "wrong_waypoint_count",  "wrong_size",    "not_finite", "foot_pose", "com",
    "joint_limit", "environment_collision", "self_collision"};

template <class Enum, std::size_t n>
std::optional<Enum> Parse(const std::array<std::string_view, n>& names, std::string_view text) {
  for (std::size_t i = 0; i < n; ++i) {
    if (names[i] == text) return static_cast<Enum>(i);
  }
  return std::nullopt;
}

template <std::size_t n>
bool Contains(const std::array<std::string_view, n>& names, std::string_view text) {
  for (const std::string_view name : names) {
    if (name == text) return true;
  }
  return false;
}

std::string NegativeCount(const ResultRecord& result) {
  if (result.iterations < 0) return "iterations";
  if (result.restarts < 0) return "restarts";
  if (result.wall_us < 0) return "wall_us";
  if (result.cpu_us < 0) return "cpu_us";
  if (result.involuntary_context_switches < 0) return "involuntary_context_switches";
  if (result.peak_memory_bytes < 0) return "peak_memory_bytes";
  return {};
}

std::string FaultOfText(std::string_view text, std::size_t max_bytes) {
  if (!text.empty() && text.size() <= max_bytes && text.find('\0') == std::string_view::npos) return {};
  return "must have 1 to " + std::to_string(max_bytes) + " bytes";
}

}  // namespace

std::string FaultOfName(std::string_view name) { return FaultOfText(name, kMaxNameBytes); }

std::string FaultOfTag(std::string_view tag) {
  if (tag.find(',') != std::string_view::npos) return "must not hold a comma";
  return FaultOfText(tag, kMaxTagBytes);
}

std::string_view ToString(JobState state) { return kJobStates.at(static_cast<std::size_t>(state)); }
std::string_view ToString(AttemptOutcome outcome) { return kAttemptOutcomes.at(static_cast<std::size_t>(outcome)); }
std::string_view ToString(ExperimentState state) { return kExperimentStates.at(static_cast<std::size_t>(state)); }
std::string_view ToString(Hold hold) { return kHolds.at(static_cast<std::size_t>(hold)); }

std::optional<JobState> ParseJobState(std::string_view text) { return Parse<JobState>(kJobStates, text); }
std::optional<AttemptOutcome> ParseAttemptOutcome(std::string_view text) {
  return Parse<AttemptOutcome>(kAttemptOutcomes, text);
}
std::optional<ExperimentState> ParseExperimentState(std::string_view text) {
  return Parse<ExperimentState>(kExperimentStates, text);
}
std::optional<Hold> ParseHold(std::string_view text) { return Parse<Hold>(kHolds, text); }

std::string FaultOf(const ResultRecord& result) {
  if (!Contains(kSolverStatuses, result.solver_status))
    return "solver_status '" + result.solver_status + "' is unknown";
  if (!Contains(kVerdicts, result.verdict_literal))
    return "verdict_literal '" + result.verdict_literal + "' is unknown";
  if (!Contains(kVerdicts, result.verdict_strict)) return "verdict_strict '" + result.verdict_strict + "' is unknown";
  if (const std::string field = NegativeCount(result); !field.empty()) return field + " is negative";
  if (result.num_waypoints < 1) return "num_waypoints is below 1";
  const bool success = result.verdict_literal == kSuccess || result.verdict_strict == kSuccess;
  if (success && !std::isfinite(result.cost)) return "a success without a finite cost";
  if (result.windows < 0 || result.windows_solved < 0 || result.windows_solved > result.windows) {
    return "windows_solved (" + std::to_string(result.windows_solved) + ") is not within 0 .. windows (" +
           std::to_string(result.windows) + ")";
  }
  if (result.interpolation_environment_depth_m < 0 || result.interpolation_self_depth_m < 0) {
    return "a depth of the interpolation is negative";
  }
  if (result.interpolation_free_share < 0 || result.interpolation_free_share > 1) {
    return "interpolation_free_share is not within 0 .. 1";
  }
  const std::size_t size = result.waypoints.size();
  if (size > 0 && (result.waypoint_size < 1 || size % static_cast<std::size_t>(result.waypoint_size) != 0)) {
    return "the number of waypoint values (" + std::to_string(size) + ") is not a multiple of waypoint_size (" +
           std::to_string(result.waypoint_size) + ")";
  }
  return {};
}

}  // namespace legopt::db
