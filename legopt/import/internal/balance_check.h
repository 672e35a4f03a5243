#pragma once

#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/import/internal/dataset_diagnostic.h"

namespace legopt {

/// Finds stances that hold the centre of mass anywhere (IsUnbounded): contacts press against each other with forces
/// without bound, and balance demands nothing. An error if hands carry and no effort limit bounds the forces either, so
/// that every posture counts as held by every rule; else a warning. Empty if there is none.
std::vector<DatasetDiagnostic> CheckBalance(const Dataset& dataset);

}  // namespace legopt
