#pragma once

#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/import/finding.h"

namespace legopt {

/// What can be computed with, but is hardly meant: all findings are warnings, and there may be none. Looks at numbers
/// only, in a millisecond.
///
/// Sizes that look like millimetres: a scene wider than 200 m, a robot larger than 10 m. Limits that look like degrees
/// (beyond 2 pi + 0.1 rad on a revolute joint), joints whose limits are equal, bodies that move and have shapes but no
/// mass, joints without axis, inertias that no body has (urdf_review.h).
std::vector<DatasetFinding> CheckPlausibility(const Dataset& dataset);

}  // namespace legopt
