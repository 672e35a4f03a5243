#pragma once

#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/import/dataset_diagnostic.h"

namespace legopt {

/// Finds values that are valid but suspicious. All findings are warnings, and there may be none. Checks numbers only,
/// within a millisecond.
///
/// Sizes that suggest millimetres: a scene wider than 200 m, a robot larger than 10 m. Limits that suggest degrees
/// (beyond 2 pi + 0.1 rad on a revolute joint), joints with equal limits, moving bodies with geometry but no mass,
/// joints without axis, physically impossible inertias (urdf_review.h).
std::vector<DatasetDiagnostic> CheckPlausibility(const Dataset& dataset);

}  // namespace legopt
