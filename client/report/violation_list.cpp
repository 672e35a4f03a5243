#include "client/report/violation_list.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "db/named_queries.h"

namespace legopt::client {
namespace {

Listing EmptyListing() {
  Listing listing;
  listing.columns = {"check", "rule", "value", "unit", "tolerance", "waypoint", "subject"};
  return listing;
}

// Position in kChecks; behind all for a name that this build does not know.
std::size_t PositionOf(const nlohmann::json& name) {
  const std::optional<Verdict> check = ParseEnum<Verdict>(name.get<std::string>());
  return check ? static_cast<std::size_t>(*check) : kChecks.size();
}

void Sort(Listing* listing) {
  std::ranges::stable_sort(listing->rows, {}, [](const auto& row) { return PositionOf(row.at(0)); });
}

}  // namespace

Listing ViolationListing(std::span<const Violation> violations) {
  Listing listing = EmptyListing();
  for (const Violation& violation : violations) {
    const CheckDescription& check = DescriptionOf(violation.check);
    listing.rows.push_back({check.name, ToString(violation.rule),
                            std::isfinite(violation.value) ? nlohmann::json(violation.value) : nlohmann::json(),
                            check.unit, ToleranceText(check),
                            violation.waypoint < 0 ? nlohmann::json() : nlohmann::json(violation.waypoint),
                            violation.subject});
  }
  Sort(&listing);
  return listing;
}

Listing ReadViolations(ResultSource& source, std::int64_t job_id) {
  const Listing stored = source.Query(db::Sql(db::Query::kViolationsOfJob, {{"job_id", job_id}}));
  Listing listing = EmptyListing();
  for (std::size_t i = 0; i < stored.rows.size(); ++i) {
    const auto& name = stored.At(i, "check_name");
    const std::size_t position = PositionOf(name);
    const bool known = position < kChecks.size();
    listing.rows.push_back({name, stored.At(i, "rule"), stored.At(i, "value"), known ? kChecks[position].unit : "",
                            known ? ToleranceText(kChecks[position]) : "", stored.At(i, "waypoint"),
                            stored.At(i, "subject")});
  }
  Sort(&listing);
  return listing;
}

}  // namespace legopt::client
