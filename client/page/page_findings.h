#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "legopt/evaluate/findings.h"

namespace legopt::client {

/// Findings of one waypoint as docs/page-data.md has them, with the names of links, objects and joints. `dataset`: of
/// the findings.
nlohmann::ordered_json FindingsJson(const WaypointFindings& findings, const Dataset& dataset);

/// Overlaps alone, as between waypoints.
nlohmann::ordered_json OverlapsJson(const std::vector<OverlapFinding>& overlaps, const Dataset& dataset);

}  // namespace legopt::client
