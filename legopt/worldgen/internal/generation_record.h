#pragma once

#include <string>

#include "legopt/worldgen/dataset_builder.h"

namespace legopt::worldgen {

/// Formats all values that determine stances, plans and postures of a dataset as JSON: the options, and values derived
/// from the robot. Lengths in metres, angles in radians.
std::string DescribeGeneration(const DatasetOptions& options, const ProbeOptions& probe, const PlannerOptions& planner);

}  // namespace legopt::worldgen
