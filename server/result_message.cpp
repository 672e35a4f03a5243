#include "server/result_message.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string_view>
#include <tuple>
#include <utility>

#include "bus/message_fields.h"

namespace legopt::server {
namespace {

using Request = legopt_msg::result_request;
constexpr auto& kFields = bus::kFields<Request>;
constexpr std::size_t kNumFields = std::tuple_size_v<std::remove_cvref_t<decltype(kFields)>>;

// Columns that are not copied from a field.
constexpr bool IsDerived(std::string_view column) { return column == "num_waypoints"; }

// Returns kNumFields if there is no such field.
consteval std::size_t IndexOfField(std::string_view name) {
  std::size_t index = 0, found = kNumFields;
  const auto look = [&](std::string_view candidate) {
    if (candidate == name) found = index;
    ++index;
  };
  std::apply([&](const auto&... fields) { (look(fields.name), ...); }, kFields);
  return found;
}

template <class Value>
void Take(std::string_view /*name*/, const Value& field, Value& member, std::string& /*fault*/) {
  member = field;
}
template <NamedEnum Enum>
void Take(std::string_view name, const std::string& field, Enum& member, std::string& fault) {
  if (const auto value = ParseEnum<Enum>(field)) {
    member = *value;
  } else if (fault.empty()) {
    fault = std::string(name) + " '" + field + "' is unknown";
  }
}

template <NamedEnum Enum>
void Take(std::string_view name, const std::string& field, std::optional<Enum>& member, std::string& fault) {
  if (field.empty()) return;
  Take(name, field, member.emplace(), fault);
}

void TakeViolations(const Request& request, ReportedResult& result) {
  for (const legopt_msg::violation& reported : request.violations) {
    Violation& violation = result.record.violations.emplace_back();
    Take("violations: check", reported.check, violation.check, result.fault);
    Take("violations: rule", reported.rule, violation.rule, result.fault);
    violation.waypoint = reported.waypoint;
    violation.subject = reported.subject;
    violation.value = reported.value;
  }
}

template <std::size_t i>
void TakeColumn(const Request& request, ReportedResult& result) {
  constexpr const auto& column = std::get<i>(db::kResultColumns);
  if constexpr (requires { column.member; }) {
    if constexpr (!IsDerived(column.name)) {
      constexpr std::size_t index = IndexOfField(column.name);
      static_assert(index < kNumFields, "a column of results needs a field of its name, or must be derived");
      Take(column.name, request.*std::get<index>(kFields).member, result.record.*column.member, result.fault);
    }
  }
}

template <std::size_t... i>
void TakeColumns(const Request& request, ReportedResult& result, std::index_sequence<i...> /*columns*/) {
  (TakeColumn<i>(request, result), ...);
}

}  // namespace

db::AttemptOutcome OutcomeOf(const Request& request) {
  switch (ReportedOutcome{request.outcome}) {
    case ReportedOutcome::kFinished:
      return db::AttemptOutcome::kFinished;
    case ReportedOutcome::kCrashed:
      return db::AttemptOutcome::kCrashed;
    case ReportedOutcome::kTimeLimit:
      return db::AttemptOutcome::kTimeLimit;
    case ReportedOutcome::kMemoryLimit:
      return db::AttemptOutcome::kMemoryLimit;
    case ReportedOutcome::kCancelled:
      return db::AttemptOutcome::kCancelled;
    case ReportedOutcome::kRefused:
      return db::AttemptOutcome::kReturned;
    case ReportedOutcome::kError:
      break;
  }
  return db::AttemptOutcome::kError;
}

ReportedResult ResultOf(const Request& request) {
  ReportedResult result;
  TakeColumns(request, result, std::make_index_sequence<std::tuple_size_v<decltype(db::kResultColumns)>>());
  TakeViolations(request, result);
  result.record.num_waypoints = std::max(request.num_waypoints, 1);
  result.record.waypoint_size = request.waypoint_size;
  result.record.waypoints = request.waypoints;
  result.record.first_unsolved = request.first_unsolved;
  result.record.num_unsolved = request.num_unsolved;
  result.record.unsolved = request.unsolved;
  return result;
}

}  // namespace legopt::server
