#include "db/result_record.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <utility>

namespace legopt::db {
namespace {

template <class Value>
std::string FaultOfColumn(const ResultColumn<Value>& column, const ResultRecord& result) {
  if constexpr (std::is_arithmetic_v<Value>) {
    const auto value = static_cast<double>(result.*column.member);
    if (!(value < column.least || value > column.most)) return {};  // NaN passes: it becomes NULL
    std::string fault(column.name);
    if (!std::isinf(column.most)) {
      return fault + " is not within " + std::to_string(std::lround(column.least)) + " .. " +
             std::to_string(std::lround(column.most));
    }
    return fault + (column.least == 0 ? " is negative" : " is below " + std::to_string(std::lround(column.least)));
  } else {
    return {};
  }
}

}  // namespace

std::string ShownResultColumns() {
  std::string list;
  const auto add = [&list](const auto& column) {
    list += list.empty() ? "" : ", ";
    if constexpr (requires { column.shown_as; }) {
      list += std::string(column.shown_sql) +
              (column.shown_as == column.shown_sql ? "" : " AS " + std::string(column.shown_as));
    } else {
      list += column.name;
    }
  };
  std::apply([&](const auto&... columns) { (add(columns), ...); }, kResultColumns);
  return list;
}

namespace {

std::string FaultOfWindows(const ResultRecord& result) {
  if (result.windows_solved > result.windows) {
    return "windows_solved (" + std::to_string(result.windows_solved) + ") is not within 0 .. windows (" +
           std::to_string(result.windows) + ")";
  }
  const std::string word = "'" + std::string(ToString(Verdict::kWindowUnsolved)) + "'";
  const auto by_rule = {result.verdict_literal, result.verdict_strict, result.verdict_solid, result.verdict_physical};
  const auto num_rules = std::ranges::count(by_rule, Verdict::kWindowUnsolved);
  if (num_rules != 0 && num_rules != std::ssize(by_rule)) return "verdict " + word + " by some rules only";
  if (num_rules != 0 && result.windows_solved == result.windows) return "verdict " + word + " with all windows solved";
  if (num_rules == 0 && (result.window_verdict || !result.unsolved.empty())) {
    return "a window without a solution, but no verdict " + word;
  }
  const std::size_t size = result.unsolved.size();
  if (size > 0 && (result.num_unsolved < 1 || size % static_cast<std::size_t>(result.num_unsolved) != 0)) {
    return "the number of unsolved values (" + std::to_string(size) + ") is not a multiple of num_unsolved (" +
           std::to_string(result.num_unsolved) + ")";
  }
  return {};
}

std::string FaultOfViolations(const ResultRecord& result) {
  std::set<std::pair<Verdict, Rule>> seen;
  for (const Violation& violation : result.violations) {
    const std::string name(ToString(violation.check)), of = "the value of check '" + name + "' ";
    if (!DescriptionOf(violation.check).measured()) return "check '" + name + "' has no value";
    if (!(violation.value >= 0)) return of + "is negative or not a number";
    if (violation.waypoint < -1) return of + "has waypoint " + std::to_string(violation.waypoint);
    if (!seen.emplace(violation.check, violation.rule).second) {
      return of + "by the " + std::string(ToString(violation.rule)) + " rule occurs twice";
    }
  }
  return {};
}

}  // namespace

bool ResultRecord::SolvedBy(Rule rule) const {
  switch (rule) {
    case Rule::kLiteral:
      return verdict_literal == Verdict::kSuccess;
    case Rule::kStrict:
      return verdict_strict == Verdict::kSuccess;
    case Rule::kSolid:
      return verdict_solid == Verdict::kSuccess;
    case Rule::kPhysical:
      return verdict_physical == Verdict::kSuccess;
  }
  return false;
}

std::string FaultOf(const ResultRecord& result) {
  std::string fault;
  ForEachResultColumn([&](const auto& column) {
    if (fault.empty()) fault = FaultOfColumn(column, result);
  });
  if (!fault.empty()) return fault;
  const bool success = result.verdict_literal == Verdict::kSuccess || result.verdict_strict == Verdict::kSuccess;
  if (success && !std::isfinite(result.cost)) return "a success without a finite cost";
  for (const auto& [rule, verdict] :
       {std::pair(Rule::kLiteral, result.verdict_literal), std::pair(Rule::kStrict, result.verdict_strict),
        std::pair(Rule::kSolid, result.verdict_solid)}) {
    const Rule first = DescriptionOf(verdict).first_rule();
    if (first > rule && first >= Rule::kSolid) {
      return "verdict '" + std::string(ToString(verdict)) + "' by a more lenient rule than the " +
             std::string(ToString(first)) + " one";
    }
  }
  if (result.verdict_solid == Verdict::kSuccess && result.verdict_strict != Verdict::kSuccess) {
    return "a success by the solid rule that is none by the strict one";
  }
  if (result.verdict_physical == Verdict::kSuccess && result.verdict_solid != Verdict::kSuccess) {
    return "a success by the physical rule that is none by the solid one";
  }
  if (fault = FaultOfWindows(result); !fault.empty()) return fault;
  if (fault = FaultOfViolations(result); !fault.empty()) return fault;
  const std::size_t size = result.waypoints.size();
  if (size > 0 && (result.waypoint_size < 1 || size % static_cast<std::size_t>(result.waypoint_size) != 0)) {
    return "the number of waypoint values (" + std::to_string(size) + ") is not a multiple of waypoint_size (" +
           std::to_string(result.waypoint_size) + ")";
  }
  return {};
}

}  // namespace legopt::db
