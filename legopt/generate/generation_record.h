#pragma once

#include <string>

#include "legopt/generate/dataset_builder.h"

namespace legopt::generate {

/// JSON text of everything that decides stances, plans and postures of a dataset: what was asked for, and what followed
/// from the robot. Lengths in metres, angles in radians.
std::string DescribeGeneration(const DatasetOptions& options, const ProbeOptions& probe, const PlannerOptions& planner);

}  // namespace legopt::generate
