#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "legopt/judge/waypoint_inspector.h"

namespace legopt::client {

/// Returns the findings of one waypoint in the format of docs/reference/page-data.md, with the names of links, objects
/// and joints. `dataset` must be the dataset of the findings.
nlohmann::ordered_json FindingsJson(const WaypointDiagnostics& findings, const Dataset& dataset);

/// Returns only overlaps, as needed between waypoints.
nlohmann::ordered_json OverlapsJson(const std::vector<OverlapDiagnostic>& overlaps, const Dataset& dataset);

}  // namespace legopt::client
