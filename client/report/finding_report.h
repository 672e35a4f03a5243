#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>

#include "client/report/table.h"
#include "legopt/import/internal/dataset_diagnostic.h"

namespace legopt::client {

/// Returns lines such as "ok    quaternion order  w first: ...: quaternions are w x y z", with "warn" or "FAIL" for
/// problems; the remedy follows on a separate line.
Table TableOf(std::span<const DatasetDiagnostic> findings);

/// Returns one object per finding with severity, check, file, field, value, message, fix.
nlohmann::ordered_json DatasetFindingsToJson(std::span<const DatasetDiagnostic> findings);

}  // namespace legopt::client
